"""The ranges of rays for which the arithmetic of boxes and triangles holds."""

# The largest coordinate of an origin: as far as float32 boxes can tell from infinity.
FARTHEST = 2.0**126
# The range of a direction's largest component. Its product with a determinant stays a normal float64 number: with
# LONGEST for determinants up to 2^254, the most that FARTHEST allows, and with SHORTEST for those down to 2^-713, a
# rounding of the least that ``octree._LEAST_SIDE`` allows. What is less is uncertain, and computed in other units.
SHORTEST, LONGEST = 2.0**-300, 2.0**700
# A component of a direction that is less than this share of the largest counts as 0. Its products with coordinates from
# 2^-100 on would fall below the normal numbers, where no bound of an error holds.
FLATTEST = 2.0**-700
