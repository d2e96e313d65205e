"""Entries of a stack of octants, int64: the entry distance of a ray above the 32 bits of the octant."""

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import bits_float

_LOW_WORD = 0xFFFFFFFF


@inlined
def distance_of(entry):
    """The distance, float32."""
    return bits_float(entry >> 32)


@inlined
def octant_of(entry):
    """The number of the octant, 0 or more."""
    return entry & _LOW_WORD


@inlined
def child_of_entry(entry):
    """The child of an entry that has one in place of an octant number: int32, perhaps negative."""
    return np.int64(np.int32(entry & _LOW_WORD))


@inlined
def with_child(entry, child):
    """The entry with a child in place of its number."""
    return ((entry >> 32) << 32) | child & _LOW_WORD
