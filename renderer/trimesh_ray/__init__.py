"""trimesh's rays, points inside and distances by the octree: the same calls, exact answers.

    import renderer.trimesh_ray
    renderer.trimesh_ray.install()

Every ``trimesh.Trimesh`` made from then on uses the octree, until ``uninstall()``. ``with installed():`` does the same
for a block, and ``python -m renderer.trimesh_ray script.py`` for a script that cannot be changed. For one mesh:
``mesh.ray = RayMeshIntersector(mesh)``. Nothing is built or compiled before the first query.
"""

from renderer.trimesh_ray.install import install, installed, uninstall
from renderer.trimesh_ray.intersector import RayMeshIntersector

__all__ = ["RayMeshIntersector", "install", "installed", "uninstall"]
