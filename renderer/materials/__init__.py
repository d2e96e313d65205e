"""The materials of surfaces: the fields of each material, its row for the kernels, and its shading."""
