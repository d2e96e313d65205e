"""All hits of rays, and the contacts that they make at shared edges and corners."""
