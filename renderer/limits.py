"""The ranges of rays for which the arithmetic of boxes and triangles holds."""

# Origins as far as float32 boxes can tell from infinity.
FARTHEST = 2.0**126
# Directions, by their largest component, whose product with a determinant, at most 2^254 there, stays a normal float64
# number, as does one of 2^-300 with the shortest.
SHORTEST, LONGEST = 2.0**-600, 2.0**700
