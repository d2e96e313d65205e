"""The first hits of a process, which imports no more than a user's script does."""


def first_hit(size: str) -> None:
    """Build an octree over a small mesh of this size and trace three rays."""
    import numpy as np

    from renderer import Octree
    from renderer.mesh.shapes import icosphere

    ball = icosphere(3)
    octree = Octree(ball.vertices.astype(np.float32).astype(np.float64) * float(size), ball.faces)
    origins, directions = np.eye(3) * 3.0, -np.eye(3)
    assert octree.closest_hit(origins, directions).hit.all()
