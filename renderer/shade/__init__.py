"""Light in kernels: a scene as records, the surface that a ray met, direct light, Whitted's recursion."""
