"""Mitsuba's variants in one process: which ones exist, and a context that selects one."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import mitsuba as mi

import validation.references.mitsuba.scene  # noqa: F401  # selects scalar_rgb, which the rest of the suite expects
from validation.benchmark.peers import libllvm

SCALAR, LLVM = "scalar_rgb", "llvm_ad_rgb"


@cache
def libllvm_path() -> str | None:
    """The libLLVM for ``llvm_ad_rgb`` in this process, or None; searched once."""
    if LLVM not in mi.variants():
        return None
    path = libllvm.usable()
    if path is not None:
        os.environ[libllvm.VARIABLE] = path
    return path


@contextmanager
def using(variant: str) -> Iterator[None]:
    """Select ``variant`` for a block, then restore the one before. Switching takes 0.1 s: keep it off every clock."""
    before = mi.variant()
    if variant != before:
        mi.set_variant(variant)
    try:
        yield
    finally:
        if variant != before:
            mi.set_variant(before)
