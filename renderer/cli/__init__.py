"""The commands ``octree-render`` and ``octree-validate``."""
