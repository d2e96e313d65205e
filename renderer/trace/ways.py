"""Reading the traced trees in kernels: one mesh's tree, or a scene of placed trees."""

from typing import Any, NamedTuple


class Ways(NamedTuple):
    """The kernels by which a traversal reads what it traces. They are chosen when it is compiled, and cost no call.

    Nodes, blocks, and places in them are numbers that only these kernels take apart.

    corners          corners(tree, base, rows): ``intersect.load_corners``
    coordinate       coordinate(tree, at): ``edge_signs.coordinate``
    face             face(tree, slot): ``intersect.face_in``
    corners_of_face  corners_of_face(tree, starts, face): ``record.corners_in``
    child            child(tree, node, octant): ``walk.child_in``
    boxes            boxes(tree, node): ``walk.boxes_of``
    enter            enter(tree, node, single, upper): ``single_ray.enter_node`` up to a distance
    begin            begin(tree, rays, prepared, r, number): what a lane keeps of a ray beside ``ray_lanes.prepare_ray``
    node_of          node_of(tree, prepared, r): nodes, links and the place of the node that a lane is at
    resume           resume(tree, rays, prepared, lanes, r, any_hit): ``stream.resume``
    may_hit          may_hit(tree, place, mask, ignored): whether a ray with that mask, which ignores one instance, may
                     hit the faces of a block, or below a node
    admits           admits(tree, w, dz): whether a hit counts from the side on which the signs of its w and the ray's
                     ``Shear.direction_z`` put the ray
    trace_packet     trace_packet(tree, rays, stack, any_hit): ``packet.trace_packet``
    """

    corners: Any
    coordinate: Any
    face: Any
    corners_of_face: Any
    child: Any
    boxes: Any
    enter: Any
    begin: Any
    node_of: Any
    resume: Any
    may_hit: Any
    admits: Any
    trace_packet: Any
