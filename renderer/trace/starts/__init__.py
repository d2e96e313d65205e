"""Rays that start on the surface: the exact start, the faces that contain it, and whether one stops the ray there."""
