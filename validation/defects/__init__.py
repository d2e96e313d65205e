"""Seeded defects: each breaks one rule of the renderer, and at least one gate must fail."""
