"""Adapters of the reference systems to our interfaces: closest hits, pictures and FLIP."""
