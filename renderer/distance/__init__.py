"""How far points are from a mesh."""
