"""Extreme cases of queries about a mesh: what is inside, what is nearest, all that a ray meets."""
