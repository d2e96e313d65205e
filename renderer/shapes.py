"""Meshes of simple shapes: float64, faces wound outward, vertices shared between faces."""

from renderer.mesh.shapes import box, grid, icosphere, torus

__all__ = ["box", "grid", "icosphere", "torus"]
