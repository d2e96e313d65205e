"""Triangle meshes, the shapes that come with the package, and the files that meshes are read from."""
