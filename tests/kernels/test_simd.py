"""Vectors in kernels: every operation against NumPy, lane by lane and bit for bit."""

import numpy as np
import pytest
from cases import cases
from numba import njit

from renderer.jit.decorators import kernel
from renderer.numerics.simd import (
    add_each,
    bits_float,
    broadcast_like,
    counting8,
    double_of,
    equal4,
    fabs,
    float32_pointer,
    float64_pointer,
    gather8,
    int32_pointer,
    is_negative,
    joined,
    load,
    load4,
    load8,
    load_strided8,
    lowest_bit,
    maximum,
    minimum,
    movemask,
    narrow,
    permuted,
    pointer,
    select,
    set_first,
    splat4,
    splat8,
    square_root,
    store,
    widen,
)
from renderer.trace.walk import entered_in_order

F32 = [0.0, -0.0, 1.0, -1.5, np.inf, -np.inf, np.nan, 1e-45, 3.4e38, 0.1, 0.3, 7.0]


def operations_of(load, splat, lanes):
    """Each operation on a number of lanes, one result behind the other."""

    @njit
    def operations(a, b, c, out, masks):
        x, y, s = load(a, 3), load(b, 1), splat(c)
        store(out, 0, x + y)
        store(out, lanes, x - y)
        store(out, 2 * lanes, x * y)
        store(out, 3 * lanes, x / y)
        store(out, 4 * lanes, select(x < y, x, y))
        store(out, 5 * lanes, s)
        store(out, 6 * lanes, x * y - s)
        store(out, 7 * lanes, select((x > y) | (x < s), s, x))
        masks[0], masks[1], masks[2], masks[3] = movemask(x < y), movemask(x <= y), movemask(x > y), movemask(x >= y)
        masks[4], masks[7] = movemask(x != y), movemask(x == y)
        masks[5], masks[6] = movemask((x < y) & (x < s)), movemask((x < y) | (x < s))

    return operations


OPERATIONS = {8: operations_of(load8, splat8, 8), 4: operations_of(load4, splat4, 4)}


def bits_of(mask):
    return int((mask * 2 ** np.arange(len(mask))).sum())


@cases("lanes, stored", [(8, np.float32), (4, np.float64), (4, np.float32)])
@cases("seed", range(5))
def test_operations_equal_numpy(lanes, stored, seed):
    rng = np.random.default_rng(seed)
    kind = np.float32 if lanes == 8 else np.float64
    a, b = (rng.choice([*F32, *rng.normal(size=8)], 16).astype(stored) for _ in range(2))
    # Everything outside the lanes stays as it is.
    out, masks = np.full(8 * lanes + 3, 77, kind), np.zeros(8, np.int64)
    c = kind(rng.normal())
    OPERATIONS[lanes](a, b, c, out, masks)
    x, y, s = a[3 : 3 + lanes].astype(kind), b[1 : 1 + lanes].astype(kind), np.full(lanes, c)
    with np.errstate(all="ignore"):
        expected = [
            x + y, x - y, x * y, x / y, np.where(x < y, x, y), s, x * y - s, np.where((x > y) | (x < s), s, x),
        ]  # fmt: skip
    got = out[: 8 * lanes].reshape(8, lanes)
    np.testing.assert_array_equal(got, expected)
    number = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(got)[number], np.signbit(expected)[number])
    assert (out[8 * lanes :] == 77).all()
    # Comparisons with NaN are false, != included: it is ordered.
    ordered = (x != y) & ~np.isnan(x) & ~np.isnan(y)
    wanted = [x < y, x <= y, x > y, x >= y, ordered, (x < y) & (x < s), (x < y) | (x < s), x == y]
    assert masks.tolist() == [bits_of(mask) for mask in wanted]


def test_products_and_differences_are_not_fused():
    # (1 + u)(1 - u) rounds to 1; a fused multiply-add would leave -u^2.
    for lanes, kind in ((8, np.float32), (4, np.float64)):
        u = np.finfo(kind).eps
        a, b = np.full(16, 1 + u, kind), np.full(16, 1 - u, kind)
        out, masks = np.empty(8 * lanes, kind), np.zeros(8, np.int64)
        OPERATIONS[lanes](a, b, kind(1), out, masks)
        assert (out[6 * lanes : 7 * lanes] == 0).all()


@njit
def roots_of(a8, a4, out8, out4):
    store(out8, 0, square_root(load8(a8, 0)))
    store(out4, 0, square_root(load4(a4, 0)))


def test_square_roots_are_rounded_as_numpy_rounds_them():
    a8 = np.array([0.0, -0.0, 2.0, 1e-45, 3.4e38, np.inf, -1.0, np.nan], np.float32)
    for a4 in ([2.0, 0.1, 5e-324, 1.7e308], [0.0, -1.0, np.inf, np.nan]):
        out8, out4 = np.zeros(8, np.float32), np.zeros(4)
        roots_of(a8, np.array(a4), out8, out4)
        with np.errstate(invalid="ignore"):
            np.testing.assert_array_equal(out8, np.sqrt(a8))
            np.testing.assert_array_equal(out4, np.sqrt(a4))


@njit
def bit_operations(bits):
    return bits_float(bits), lowest_bit(bits)


def test_bits():
    for value in np.array([0, 1e-45, 1e-30, 1, 1.5, 3e38, np.inf], np.float32):
        assert bit_operations(np.int64(value.view(np.int32)) | (5 << 32))[0] == value
    for k in range(63):
        assert bit_operations(1 << k)[1] == k
        assert bit_operations((1 << k) | (1 << 62))[1] == k


@njit
def equal_words(words, index, value):
    return equal4(pointer(words), index, value)


def test_words_that_are_equal():
    words = np.array([7, -1, 3, 3, -1, 3], np.int32)
    for value, bits in ((3, 0b0110), (-1, 0b1001), (7, 0)):
        assert equal_words(words, 1, value) == bits


@njit
def extremes_of(a, b):
    return maximum(a, b), minimum(a, b)


@cases("kind", [np.float32, np.float64, np.int32, np.int64])
def test_larger_and_smaller_are_those_of_python(kind):
    """Also which of two equal ones, and of a NaN and a number, is taken: the first."""
    values = [kind(v) for v in ([0, 1, -5, 7] if np.issubdtype(kind, np.integer) else F32)]
    for a in values:
        for b in values:
            got, expected = extremes_of(a, b), (max(a, b), min(a, b))
            for one, other in zip(got, expected, strict=True):
                assert np.array([one], kind).tobytes() == np.array([other], kind).tobytes(), (a, b)


@njit
def through_addresses(floats, doubles, integers, bits):
    a, b, c = float32_pointer(floats), float64_pointer(doubles), int32_pointer(integers)
    store(a, 1, load(a, 0) + np.float32(1.0))
    store(b, 1, load(b, 0) + 1.0)
    store(c, 1, load(c, 0) + np.int32(1))
    return double_of(bits)


def test_pointers_from_addresses():
    arrays = np.array([2, 0], np.float32), np.array([1 / 3, 0]), np.array([-9, 0], np.int32)
    assert through_addresses(*(a.ctypes.data for a in arrays), np.float64(-0.1).view(np.int64)) == -0.1
    assert [a[1] for a in arrays] == [np.float32(3), 1 / 3 + 1, -8]


@kernel
def put_in_order(distances, links, limit, order, out, numbers):
    octants = load8(distances, 0)
    lanes, bits = entered_in_order(octants <= splat8(limit), order)
    store(out, 1, joined(permuted(load8(links, 2), lanes), permuted(octants, lanes)))
    store(numbers, 1, add_each(lanes, 40))
    return bits


@cases("seed", range(200))
def test_lanes_come_in_any_order_with_those_of_a_mask_first(seed):
    """Any number of them, among them equal distances, -0.0 and infinity."""
    rng = np.random.default_rng(seed)
    distances = rng.choice([0.0, -0.0, np.inf, 1e-45, 2.5, np.nan, *rng.uniform(0, 9, 8)], 8).astype(np.float32)
    links = rng.integers(-(2**31), 2**31, 10, dtype=np.int32)
    places, limit = rng.permutation(8), np.float32(rng.choice([-1.0, 0.0, 3.0, np.inf]))
    out, numbers, order = np.full(10, 77), np.full(10, 77, np.int32), sum(int(p) << 3 * k for k, p in enumerate(places))
    bits = put_in_order(distances, links, limit, np.int32(order), out, numbers)
    met = [place for place in places.tolist() if distances[place] <= limit]
    assert bits == sum(1 << k for k, place in enumerate(places) if distances[place] <= limit)
    pairs = np.array([links[2:], distances.view(np.int32)]).T.copy().view(np.int64)[met].ravel()
    assert out[[0, -1]].tolist() == [77, 77] and out[1 : 1 + len(met)].tolist() == pairs.tolist()
    assert numbers[[0, -1]].tolist() == [77, 77] and numbers[1 : 1 + len(met)].tolist() == [40 + p for p in met]


@njit
def put_set_first(bits, out):
    store(out, 1, set_first(bits))


def test_lanes_of_every_mask_come_first():
    """Bits above the eight are not read."""
    out = np.full(10, 77, np.int32)
    for mask in range(256):
        put_set_first(mask | 1 << 40, out)
        expected = [k for k in range(8) if mask >> k & 1] + [k for k in range(8) if not mask >> k & 1]
        assert out.tolist() == [77, *expected, 77]


@njit
def count_on(first, step, longs, out):
    store(out, 1, counting8(first, step))
    store(out, 11, load8(longs, 1))


def test_numbers_in_equal_steps_and_loaded_ones():
    longs, out = np.random.default_rng(0).integers(-(2**63), 2**63 - 1, 9), np.full(20, 77)
    count_on(2**40, -(2**35), longs, out)
    assert out.tolist() == [77, *(2**40 - 2**35 * k for k in range(8)), 77, 77, *longs[1:], 77]


@njit
def eight_of(base, rows, step, out, ints):
    pointed = pointer(base)
    x, y = gather8(pointed, pointer(rows), step, 1), load_strided8(pointed, 2, step)
    store(out, 0, x)
    store(out, 8, y)
    store(out, 16, widen(narrow(x)))
    store(out, 24, select(is_negative(x), y, 0.5))
    store(out, 32, maximum(minimum(x, 1.0), -1.0) * 2.0 + fabs(y))
    store(out, 40, broadcast_like(7.0, x))
    store(pointer(out), 48, broadcast_like(7.0, 1.0))
    store(ints, 0, select(x > 0.0, 3, 4))
    store(ints, 8, broadcast_like(9, y))


@pytest.mark.parametrize("step", [0, 3])
def test_eight_doubles_from_anywhere_are_treated_as_one_is(step):
    rng = np.random.default_rng(step)
    base = rng.choice([0.0, -0.0, np.inf, -np.inf, 0.1, 1e300, -5e-324, *rng.normal(size=9)], 40)
    rows, out, ints = rng.integers(0, 12, 8), np.zeros(49), np.zeros(16, np.int64)
    eight_of(base, rows, step, out, ints)
    x, y = base[rows * step + 1], base[2 + step * np.arange(8)]
    with np.errstate(over="ignore"):
        rounded = x.astype(np.float32).astype(float)
    expected = [x, y, rounded, np.where(np.signbit(x), y, 0.5), np.clip(x, -1.0, 1.0) * 2.0 + np.abs(y), np.full(8, 7)]
    np.testing.assert_array_equal(out[:48].reshape(6, 8), expected)
    np.testing.assert_array_equal(np.signbit(out[:16].reshape(2, 8)), np.signbit([x, y]))
    assert out[48] == 7.0 and ints.tolist() == [*np.where(x > 0, 3, 4), *[9] * 8]


@njit
def with_numbers(a, c, out, masks):
    x = load8(a, 0)
    store(out, 0, x + c)
    store(out, 8, c - x)
    store(out, 16, maximum(x, c))
    store(out, 24, maximum(c, x))
    store(out, 32, minimum(x, c))
    store(out, 40, minimum(c, x))
    store(out, 48, select(x < c, c, x))
    masks[0], masks[1] = movemask(x < c), movemask(c <= x)


def test_a_number_beside_a_vector_stands_for_all_lanes():
    a, c = np.array([0.0, -0.0, np.nan, np.inf, -3.0, 0.5, 0.25, 7.0], np.float32), np.float32(0.5)
    out, masks = np.zeros(56, np.float32), np.zeros(2, np.int64)
    with_numbers(a, c, out, masks)
    lanes = np.full(8, c)
    with np.errstate(all="ignore"):
        less, more = np.where(a > c, a, c), np.where(a < c, a, c)
        expected = [
            a + c, c - a, np.where(c > a, c, a), less, np.where(c < a, c, a), more, np.where(a < c, lanes, a),
        ]  # fmt: skip
        assert masks.tolist() == [bits_of(a < c), bits_of(c <= a)]
    np.testing.assert_array_equal(out.reshape(7, 8), expected)


@njit
def magnitudes(a8, a4, out8, out4, number):
    store(out8, 0, fabs(load8(a8, 0)))
    store(out4, 0, fabs(load4(a4, 0)))
    return fabs(number)


def test_magnitudes_have_no_sign():
    a8 = np.array([0.0, -0.0, -1e-45, -np.inf, np.inf, -2.5, 2.5, -np.nan], np.float32)
    out8, out4 = np.zeros(8, np.float32), np.zeros(4)
    assert magnitudes(a8, np.array([-0.0, -1e300, 5.0, -np.inf]), out8, out4, -0.0).hex() == (0.0).hex()
    assert out8.tobytes() == np.abs(a8).tobytes() and out4.tolist() == [0.0, 1e300, 5.0, np.inf]
    assert not np.signbit(out4[0])
