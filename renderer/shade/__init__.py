"""Shading in kernels: the scene as records, hit surfaces, direct light, Whitted's recursion."""
