"""The kinds of cameras, a file each."""
