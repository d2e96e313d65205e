"""Kernels: compiling them, and keeping them on disk."""
