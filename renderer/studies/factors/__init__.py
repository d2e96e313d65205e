"""View factors: the share of the light that leaves one surface and reaches another."""
