"""Spatial orders of points: neighbours follow each other."""
