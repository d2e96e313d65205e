"""Vectors in kernels: every operation against NumPy, lane by lane and bit for bit."""

import numpy as np
import pytest
from numba import njit

from renderer.kernels.simd import (
    bits_float,
    double_of,
    extract,
    float32_pointer,
    float64_pointer,
    float_bits,
    get,
    int32_pointer,
    larger,
    load4,
    load8,
    lowest_bit,
    movemask,
    put,
    select,
    smaller,
    splat4,
    splat8,
    square_root,
    store,
)

F32 = [0.0, -0.0, 1.0, -1.5, np.inf, -np.inf, np.nan, 1e-45, 3.4e38, 0.1, 0.3, 7.0]


@njit
def operations8(a, b, c, out, masks):
    x, y, s = load8(a, 3), load8(b, 1), splat8(c)
    store(out, 0, x + y)
    store(out, 8, x - y)
    store(out, 16, x * y)
    store(out, 24, x / y)
    store(out, 32, select(x < y, x, y))
    store(out, 40, s)
    store(out, 48, x * y - s)
    store(out, 56, select((x > y) | (x < s), s, x))
    masks[0], masks[1], masks[2], masks[3] = movemask(x < y), movemask(x <= y), movemask(x > y), movemask(x >= y)
    masks[4], masks[7] = movemask(x != y), movemask(x == y)
    masks[5], masks[6] = movemask((x < y) & (x < s)), movemask((x < y) | (x < s))


@njit
def operations4(a, b, c, out, masks):
    x, y, s = load4(a, 3), load4(b, 1), splat4(c)
    store(out, 0, x + y)
    store(out, 4, x - y)
    store(out, 8, x * y)
    store(out, 12, x / y)
    store(out, 16, select(x < y, x, y))
    store(out, 20, s)
    store(out, 24, x * y - s)
    store(out, 28, select((x > y) | (x < s), s, x))
    masks[0], masks[1], masks[2], masks[3] = movemask(x < y), movemask(x <= y), movemask(x > y), movemask(x >= y)
    masks[4], masks[7] = movemask(x != y), movemask(x == y)
    masks[5], masks[6] = movemask((x < y) & (x < s)), movemask((x < y) | (x < s))


def bits_of(mask):
    return int((mask * 2 ** np.arange(len(mask))).sum())


@pytest.mark.parametrize("lanes, stored", [(8, np.float32), (4, np.float64), (4, np.float32)])
@pytest.mark.parametrize("seed", range(5))
def test_operations_equal_numpy(lanes, stored, seed):
    rng = np.random.default_rng(seed)
    kind = np.float32 if lanes == 8 else np.float64
    a, b = (rng.choice([*F32, *rng.normal(size=8)], 16).astype(stored) for _ in range(2))
    # Everything outside the lanes stays as it is.
    out, masks = np.full(8 * lanes + 3, 77, kind), np.zeros(8, np.int64)
    c = kind(rng.normal())
    (operations8 if lanes == 8 else operations4)(a, b, c, out, masks)
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
    for lanes, kind, operation in ((8, np.float32, operations8), (4, np.float64, operations4)):
        u = np.finfo(kind).eps
        a, b = np.full(16, 1 + u, kind), np.full(16, 1 - u, kind)
        out, masks = np.empty(8 * lanes, kind), np.zeros(8, np.int64)
        operation(a, b, kind(1), out, masks)
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
def lanes_of(a8, a4, out8, out4):
    for i in range(8):
        out8[i] = extract(load8(a8, 0), i)
    for i in range(4):
        out4[i] = extract(load4(a4, 0), i)


def test_lanes_may_be_chosen_at_run_time():
    a8, a4 = np.arange(8, dtype=np.float32) + 0.5, np.arange(4) / 3
    out8, out4 = np.zeros(8, np.float32), np.zeros(4)
    lanes_of(a8, a4, out8, out4)
    np.testing.assert_array_equal(out8, a8)
    np.testing.assert_array_equal(out4, a4)


@njit
def bit_operations(value, bits):
    return float_bits(value), bits_float(bits), lowest_bit(bits)


def test_bits():
    values = np.sort(np.abs(np.array([0, 1e-45, 1e-30, 1, 1.5, 3e38, np.inf], np.float32)))
    codes = []
    for value in values:
        code, back, _ = bit_operations(value, np.int64(value.view(np.int32)) | (5 << 32))
        assert back == value and code == value.view(np.int32)
        codes.append(code)
    assert codes == sorted(codes) and codes[0] >= 0
    assert bit_operations(np.float32(-1), 1)[0] == 0xBF800000
    for k in range(63):
        assert bit_operations(np.float32(0), 1 << k)[2] == k
        assert bit_operations(np.float32(0), (1 << k) | (1 << 62))[2] == k


@njit
def extremes_of(a, b):
    return larger(a, b), smaller(a, b)


@pytest.mark.parametrize("kind", [np.float32, np.float64, np.int32, np.int64])
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
    put(a, 1, get(a, 0) + np.float32(1.0))
    put(b, 1, get(b, 0) + 1.0)
    put(c, 1, get(c, 0) + np.int32(1))
    return double_of(bits)


def test_pointers_from_addresses():
    arrays = np.array([2, 0], np.float32), np.array([1 / 3, 0]), np.array([-9, 0], np.int32)
    assert through_addresses(*(a.ctypes.data for a in arrays), np.float64(-0.1).view(np.int64)) == -0.1
    assert [a[1] for a in arrays] == [np.float32(3), 1 / 3 + 1, -8]
