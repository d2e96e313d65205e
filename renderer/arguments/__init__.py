"""Arguments as callers give them, checked and made arrays."""
