"""Kernels: the decorators that compile them, the store of their machine code, SIMD and vectors."""
