"""trimesh's rays, points inside and distances, answered by the octree: the same calls, exact answers.

    import renderer.trimesh_ray
    renderer.trimesh_ray.install()

lets every ``trimesh.Trimesh`` made from then on ask the octree, until ``uninstall()``; ``with installed():`` does so
for a block, and ``python -m renderer.trimesh_ray script.py`` for a script that cannot be changed. One mesh alone:
``mesh.ray = RayMeshIntersector(mesh)``. Nothing is built or compiled before the first question.
"""

from renderer.trimesh_ray.install import install, installed, uninstall
from renderer.trimesh_ray.intersector import RayMeshIntersector

__all__ = ["RayMeshIntersector", "install", "installed", "uninstall"]
