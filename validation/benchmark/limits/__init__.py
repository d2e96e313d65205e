"""What bounds the time of a ray: counts of what it does, what the machine can do, and the bounds that follow."""
