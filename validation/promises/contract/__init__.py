"""The public contract, piece by piece, and who judges each piece."""
