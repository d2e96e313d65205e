"""Speed and error as functions of the parameters."""
