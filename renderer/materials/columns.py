"""The columns of a material's row in the arrays of kernels, float64, and its kinds."""

# Colours take three columns from the one named.
KIND, AMBIENT, DIFFUSE, SPECULAR, REFLECTANCE, TRANSMITTANCE = 0, 1, 4, 7, 10, 13
SHININESS, IOR = 16, 17
MATERIAL_COLUMNS = 18
# How light is reflected. From LAMBERT on, surfaces reflect that of lights, and need shadow rays.
UNLIT, CLEAR, LAMBERT, PHONG = 0, 1, 2, 3
