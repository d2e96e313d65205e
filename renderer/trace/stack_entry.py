"""Entries of a stack of octants, int64: the entry distance of a ray above the 32 bits of the octant."""

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
