"""How speed and error depend on the parameters."""
