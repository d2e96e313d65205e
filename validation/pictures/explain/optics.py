"""The laws of optics, written a second time: mirrored and refracted directions, and their shares."""

from collections.abc import Iterator

import numpy as np

from renderer.materials.base import appearance_of
from renderer.materials.dielectric import Dielectric
from renderer.materials.registry import Material
from validation.references.ray_tree import Kind, Node, Vector

# The textbook's formula for refraction loses digits near the critical angle, and is not compared within this of it.
_CRITICAL = 1e-6
# Some float64 roundings, and what the square root of _CRITICAL makes of them.
_NEAR = 1e-9


def wrong_rays(node: Node, material: Material) -> Iterator[str]:
    """The rays that leave a surface of a material otherwise than the laws say; of one with textures all but the shares,
    which the reference judges.
    """
    n = -node.shading if float(node.direction @ node.shading) > 0.0 else node.shading
    cosine = -float(node.direction @ n)
    n1, n2 = node.indices or (1.0, 1.0)
    sine2 = (n1 / n2) ** 2 * (1.0 - cosine * cosine)
    if abs(sine2 - 1.0) < _CRITICAL:
        return
    reflected = np.array(material.reflectance)
    through = np.array(getattr(material, "transmittance", (0.0, 0.0, 0.0))) * float(sine2 < 1.0)
    if isinstance(material, Dielectric):
        share = fresnel(cosine, np.sqrt(max(0.0, 1.0 - sine2)), n1, n2) if sine2 < 1.0 else 1.0
        reflected, through = share * reflected, (1.0 - share) * through
    if not appearance_of(material).is_plain:
        reflected, through = _share(node, "reflected"), _share(node, "refracted")
    yield from _compared(node, "reflected", node.direction + 2.0 * cosine * n, reflected)
    bent = n1 / n2 * node.direction + (n1 / n2 * cosine - np.sqrt(max(0.0, 1.0 - sine2))) * n
    yield from _compared(node, "refracted", bent, through)


def _share(node: Node, kind: Kind) -> Vector:
    return node.children[kind].share if kind in node.children else np.zeros(3)


def fresnel(cos_i: float, cos_t: float, n1: float, n2: float) -> float:
    """The share of unpolarised light that a boundary reflects."""
    if n1 == n2:
        return 0.0
    s = (n1 * cos_i - n2 * cos_t) / (n1 * cos_i + n2 * cos_t)
    p = (n1 * cos_t - n2 * cos_i) / (n1 * cos_t + n2 * cos_i)
    return 0.5 * (s * s + p * p)


def _compared(node: Node, kind: str, direction: Vector, share: Vector) -> Iterator[str]:
    child = node.children.get(kind)  # type: ignore[call-overload]
    if child is None:
        if float(share.max()) > _NEAR:
            yield f"face {node.face}: no {kind} ray leaves it, and its share is {share.tolist()}"
    elif not float(np.abs(child.share - share).max()) <= _NEAR:
        yield f"face {node.face}: the {kind} ray has share {child.share.tolist()}, and not {share.tolist()}"
    elif not float(np.abs(child.direction - direction).max()) <= _NEAR:
        yield f"face {node.face}: the {kind} ray goes along {child.direction.tolist()}, and not {direction.tolist()}"
