"""Trees: how they are built, checked and refitted."""
