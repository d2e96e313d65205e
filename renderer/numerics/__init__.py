"""Arithmetic of kernels: vectors, SIMD, double-double numbers, expansions and exact predicates."""
