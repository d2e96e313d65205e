"""Rays that start on the surface: the exact start, the faces that hold it, and what stops a ray there."""
