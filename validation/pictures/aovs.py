"""Primary hits, ours against Mitsuba's: the lowest rung, which tests geometry and camera apart from shading."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.picture.image import Image
from renderer.scene.camera import primary_rays
from renderer.scene.scene import Scene
from validation.gates import Gate
from validation.references.mitsuba.whitted import Aovs
from validation.thresholds import AovLimits

# The largest error where no ray was hit by both.
_NONE = 0.0


def compare(
    name: str, scene: Scene, ours: Image, theirs: Aovs, limits: AovLimits
) -> tuple[dict[str, Any], list[Gate], NDArray[np.bool_]]:
    """Shares of pixels whose distance, position, geometric or shading normal is off, and the largest errors; the gates
    on these shares; and the pixels (h, w) that are off.

    ours : a picture of one sample a pixel, of the same size as ``theirs``.

    Errors of distance and position are over the distance; those of normals are the lengths of their differences.
    """
    hit, other = ours.face >= 0, theirs.instance >= 0
    errors = _errors(scene, ours, theirs, hit & other)
    shares = {"pixels that only one renderer hits": float(np.mean(hit != other))}
    off = hit != other
    for quantity, (error, limit) in _limited(errors, limits).items():
        beyond = ~(error <= limit)
        off[hit & other] |= beyond
        shares[f"pixels whose {quantity} is off"] = float(np.sum(beyond) / hit.size)
    reason = f"within {limits.depth} of the distance and {limits.normal} rad; a float32 ray may flip an edge pixel"
    found = [
        Gate("images", f"{name}, AOVs", quantity, share, "at most", limits.share, reason, ("Image",))
        for quantity, share in shares.items()
    ]
    largest = {quantity: float(np.nanmax(error, initial=_NONE)) for quantity, error in errors.items()}
    return {"shares": shares, "largest": largest}, found, off


def _limited(errors: dict[str, NDArray[np.float64]], limits: AovLimits) -> dict[str, tuple[NDArray[np.float64], float]]:
    bounds = (limits.depth, limits.position, limits.normal, limits.normal)
    return {quantity: (error, bound) for (quantity, error), bound in zip(errors.items(), bounds, strict=True)}


def _errors(scene: Scene, ours: Image, theirs: Aovs, both: NDArray[np.bool_]) -> dict[str, NDArray[np.float64]]:
    """Errors of each pixel that both hit, in the picture's order."""
    height, width = ours.depth.shape
    origins, directions = (rays[both.ravel()] for rays in primary_rays(scene.camera, width, height))
    depth, met = ours.depth[both], theirs.depth[both]
    position = origins + depth[:, None] * directions
    corners = np.concatenate([i.mesh.vertices[i.mesh.faces] for i in scene.instances] or [np.zeros((0, 3, 3))])
    a, b, c = np.moveaxis(corners[ours.face[both]], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return {
        "distance": np.abs(depth - met) / met,
        "position": np.linalg.norm(position - theirs.position[both], axis=1) / met,
        "geometric normal": np.linalg.norm(normal - theirs.geometric_normal[both], axis=1),
        "shading normal": np.linalg.norm(ours.normal[both] - theirs.shading_normal[both], axis=1),
    }
