"""Mutants: the renderer with one small standard fault, chosen at random, that a gate or a test must notice."""
