"""Scenes for rays: many meshes, each placed many times."""
