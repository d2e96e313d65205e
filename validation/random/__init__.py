"""Scenes and meshes that nobody chose: drawn at random by a seed, and made small where they fail."""
