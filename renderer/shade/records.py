"""Columns of the arrays of lights and textures; ``scene.light`` and ``picture.maps`` write them."""

from renderer.materials.columns import AMBIENT, DIFFUSE, REFLECTANCE, SPECULAR, TRANSMITTANCE

# One row per light, float64: kind, x, y, z, red, green, blue. A directional light stores the unit vector
# towards the light, a point light its position.
LIGHT_COLUMNS = 7
DIRECTIONAL, POINT = 0, 1

# One row per material of a picture with textures, float64: for each of its colours, and for the emission, which only
# such pictures have, the number of a texture or -1; the emission; the texture of normals or -1; the opacity, its
# texture or -1, and the opacity below which a surface is not there, or 0; whether colours of vertices multiply ambient
# and diffuse light and the emission; whether there is any texture.
COLORS = (AMBIENT, DIFFUSE, SPECULAR, REFLECTANCE, TRANSMITTANCE)
EMISSION, NORMAL_MAP, OPACITY, OPACITY_MAP, CUTOFF, TINTED, MAPPED, MAP_COLUMNS = 6, 9, 10, 11, 12, 13, 14, 15

# One row per texture, float64: the place of its first texel, its size and number of levels, how it goes on beyond its
# edges along u and v, its filter, its strength, and the rows that move texture coordinates.
TEXEL, ACROSS, DOWN, LEVELS, WRAP, FILTER, STRENGTH, TRANSFORM, TEXTURE_COLUMNS = 0, 1, 2, 3, 4, 6, 7, 8, 14
REPEAT, MIRRORED, CLAMP = 0, 1, 2
NEAREST, LINEAR, MIPMAP = 0, 1, 2
