"""Points inside a mesh: exact crossings for closed meshes, winding numbers for all."""
