"""View factors: closed forms, laws, lines of Embree, and whether the errors they state are those they have."""
