"""What surfaces are made of: the fields of each material, its row for the kernels, and its shading."""
