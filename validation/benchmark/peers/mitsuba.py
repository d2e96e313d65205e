"""Mitsuba 3 as two contenders: ``scalar_rgb``, ray by ray from Python, and ``llvm_ad_rgb``, whole batches.

Both find hits with Embree in float32. Scenes and rays keep the variant in which they were made, so that no variant is
switched while a clock runs.
"""

from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from renderer.system.threads import available_threads
from validation.benchmark.peers.contender import Faces, Family, Floats, Peer, Query, System
from validation.benchmark.peers.mitsuba_variant import LLVM, SCALAR, libllvm_path, using
from validation.oracle.placing import Body
from validation.references.mitsuba.instances import instances

_ONE = Family("touch", np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))


class ScalarPeer(Peer):
    """One ``Ray3f`` for each ray, made beforehand; the Python loop over them is this variant's cost."""

    def __init__(self, scene: Any, ray: Any) -> None:
        self._scene, self._ray = scene, ray[0]

    def closest(self, rays: Family) -> Query:
        """``ray_intersect_preliminary``: t, u, v and face."""
        native, intersect = _scalar_rays(rays), self._scene.ray_intersect_preliminary
        return Query(lambda: [intersect(ray) for ray in native], lambda found: np.array([f.t for f in found], float))

    def any(self, rays: Family) -> Query:
        """``ray_test``."""
        native, test = _scalar_rays(rays), self._scene.ray_test
        return Query(lambda: [test(ray) for ray in native], lambda found: np.array(found, bool))

    def touch(self) -> None:
        """Trace one ray."""
        self._scene.ray_test(self._ray)


class LLVMPeer(Peer):
    """Rays as Dr.Jit arrays; the clock includes the evaluation of every result."""

    def __init__(self, scene: Any, ray: Any) -> None:
        self._scene, self._ray = scene, ray

    def closest(self, rays: Family) -> Query:
        """``ray_intersect_preliminary``: t, u, v and face."""
        native = _llvm_rays(rays)

        def trace() -> Any:
            found = self._scene.ray_intersect_preliminary(native)
            dr.eval(found)
            dr.sync_thread()
            return found

        return Query(trace, lambda found: found.t.numpy().astype(np.float64))

    def any(self, rays: Family) -> Query:
        """``ray_test``."""
        native = _llvm_rays(rays)

        def trace() -> Any:
            found = self._scene.ray_test(native)
            dr.eval(found)
            dr.sync_thread()
            return found

        return Query(trace, lambda found: found.numpy())

    def touch(self) -> None:
        """Trace one ray."""
        dr.eval(self._scene.ray_test(self._ray))
        dr.sync_thread()


def systems() -> list[System]:
    """The scalar variant always; the llvm variant where a working libLLVM was found."""
    scalar = System("mitsuba_scalar", "Mitsuba scalar_rgb", 1, "float32", lambda v, f: _loader(v, f, SCALAR),
                    most_rays=20_000, times_build=False, scope=partial(using, SCALAR))  # fmt: skip
    llvm = System("mitsuba_llvm", "Mitsuba llvm_ad_rgb", available_threads(), "float32",
                  lambda v, f: _loader(v, f, LLVM), scope=partial(using, LLVM))  # fmt: skip
    return [scalar] if libllvm_path() is None else [scalar, llvm]


def instances_peer(bodies: list[Body]) -> LLVMPeer:
    """A scene of instances in ``llvm_ad_rgb``, built."""
    with using(LLVM):
        peer = LLVMPeer(instances(bodies), _llvm_rays(_ONE))
        peer.touch()
    return peer


def _loader(vertices: Floats, faces: Faces, variant: str) -> Any:
    """Convert the arrays to the variant now; the result builds the mesh object, its scene and its BVH."""
    points, corners = vertices.astype(np.float32).ravel(), faces.astype(np.uint32).ravel()
    if variant == SCALAR:
        return partial(_scalar, points, corners, _scalar_rays(_ONE))
    with using(LLVM):
        return partial(_llvm, mi.Float(points), mi.UInt32(corners), _llvm_rays(_ONE))


def _scalar(points: Any, corners: Any, ray: Any) -> ScalarPeer:
    return ScalarPeer(_scene(points, corners), ray)


def _llvm(points: Any, corners: Any, ray: Any) -> LLVMPeer:
    return LLVMPeer(_scene(points, corners), ray)


def _scene(points: Any, corners: Any) -> Any:
    mesh = mi.Mesh("mesh", len(points) // 3, len(corners) // 3)
    arrays = mi.traverse(mesh)
    arrays["vertex_positions"] = points
    arrays["faces"] = corners
    arrays.update()
    return mi.load_dict({"type": "scene", "embree_use_robust_intersections": True, "mesh": mesh})


def _scalar_rays(rays: Family) -> list[Any]:
    with using(SCALAR):
        far = rays.t_max if np.isfinite(rays.t_max) else float(np.finfo(np.float32).max)
        pairs = zip(rays.origins.tolist(), rays.directions.tolist(), strict=True)
        return [mi.Ray3f(mi.Point3f(*o), mi.Vector3f(*d), far, 0.0, []) for o, d in pairs]


def _llvm_rays(rays: Family) -> Any:
    with using(LLVM):
        o, d = (np.ascontiguousarray(a.T, np.float32) for a in (rays.origins, rays.directions))
        native = mi.Ray3f(mi.Point3f(o), mi.Vector3f(d))
        if np.isfinite(rays.t_max):
            native.maxt = mi.Float(rays.t_max)
        dr.eval(native)
        return native
