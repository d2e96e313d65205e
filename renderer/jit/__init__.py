"""Kernels: how they are compiled, kept on disk and found again."""
