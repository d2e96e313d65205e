"""Distances of points from a mesh."""
