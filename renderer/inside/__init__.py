"""Which points lie inside a mesh: exact crossings for closed ones, winding numbers for all."""
