"""Columns of the arrays of materials and lights; ``scene.material`` and ``scene.light`` write them."""

# One row per material, float64. Colours take three columns from the one named.
KIND, AMBIENT, DIFFUSE, SPECULAR, REFLECTANCE, TRANSMITTANCE = 0, 1, 4, 7, 10, 13
SHININESS, IOR = 16, 17
MATERIAL_COLUMNS = 18
# A Phong material without highlights is LAMBERT; without a diffuse colour too it is UNLIT, and needs no shadow rays.
PHONG, MIRROR, DIELECTRIC, LAMBERT, UNLIT = 0, 1, 2, 3, 4

# One row per light, float64: kind, x, y, z, red, green, blue. A directional light stores the unit vector
# towards the light, a point light its position.
LIGHT_COLUMNS = 7
DIRECTIONAL, POINT = 0, 1
