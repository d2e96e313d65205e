"""Orders of points in which neighbours follow each other."""
