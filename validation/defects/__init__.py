"""Seeded defects: each breaks one rule of the renderer, and a gate must notice."""
