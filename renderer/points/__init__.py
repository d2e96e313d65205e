"""Questions that points ask of a mesh."""
