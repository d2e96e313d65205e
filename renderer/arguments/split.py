"""The ways to cut boxes of the octree; without NumPy, as the command line shows it."""

from typing import Literal

# How boxes of the octree are cut: in the middle, or by the surface area heuristic. The second takes up to a fifth
# longer to build, and saves rays among walls a fifth to a third of their steps.
Split = Literal["midpoint", "sah"]
SPLIT: Split = "sah"
