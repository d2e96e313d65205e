"""Points that ask something of a mesh: how they are checked and ordered, exact signs, and who sees whom."""
