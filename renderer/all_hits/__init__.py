"""All hits of rays, in compressed rows."""
