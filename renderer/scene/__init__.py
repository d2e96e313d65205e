"""Scenes as users write them: cameras, lights, materials, objects, and what a picture of them needs."""
