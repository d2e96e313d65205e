"""The lanes in which the rays of a stream travel."""

from cases import cases

from renderer.jit.decorators import kernel
from renderer.numerics.simd import load
from renderer.trace.stream import END, GROUPS, NO_DISTANCE, clear_lanes
from renderer.trace.traverse import new_scratch, scratch_pointers

LANES = 16 * GROUPS


@kernel
def _ended(memory, rays):
    """How many lanes, from the first on, have a stack that ends at its bottom."""
    lanes = scratch_pointers(memory, None).lanes
    clear_lanes(lanes, rays)
    for lane in range(LANES):
        bottom = lane * lanes.stack_size
        if load(lanes.children, bottom) != END or load(lanes.distances, bottom) != NO_DISTANCE:
            return lane
    return LANES


@cases("rays", [1, 8, 9, 40, 41, 1000])
def test_every_stack_that_a_ray_may_take_has_a_bottom(rays):
    """Eight lanes are taken together, whatever a scratch held before."""
    memory = new_scratch(5, rays)
    memory[1:] = 0
    assert _ended(memory, rays) >= min(-(-rays // 8) * 8, LANES)
