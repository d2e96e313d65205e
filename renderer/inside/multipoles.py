"""Series of solid harmonics for the winding number of far faces, with a bound of the truncation error.

The winding number of faces around p is a dipole potential: 1/(4 pi) of the integral of -grad 1/|x - p| along the
normals. About a centre c, within r = |x - c| and beyond it R = |p - c|, 1/|x - p| is the sum of r^n / R^(n+1) P_n over
all orders n. A series keeps the orders from 1 to ORDER as 2 n + 1 numbers each. No gradient of r^n P_n exceeds n
r^(n-1) (Bernstein and Szego). With s the largest r, q = s / R and N = ORDER, the orders above N therefore add at most

    1/(4 pi R^2) * integral of (r / R)^N * (N + 1 - N q) / (1 - q)^2.

Sources: Barill et al., Fast Winding Numbers for Soups and Clouds, SIGGRAPH 2018; for the harmonics and their operator
Dehnen, A Fast Multipole Method for Stellar Dynamics, Computational Astrophysics and Cosmology 1, 2014.
"""

import math

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import extract, load, load4, movemask, select, splat4, square_root, store

# Even, for its power comes from squares. Of 4, 6 and 8 the quickest for tolerances from 1e-1 to 1e-3.
ORDER = 6
# Eight octants' numbers are rows of eight float64: the centre, the radius s, the size (the sum of half the product of
# two sides of each face, over 4 pi s^2), the mean of (r / s)^N by area over size, and the coefficients.
X, Y, Z, RADIUS, SIZE, SPREAD, COEFFICIENTS = range(7)
ROWS = COEFFICIENTS + ORDER * (ORDER + 2)
MOMENT_WORDS = 8 * ROWS
# Above this q no series is evaluated: 1 - q keeps its digits.
_NEAREST = 0.75
# Rounding errors of a series as a share of size / R^2. A face's own numbers err by some 2^-48 of its size, and joining
# them in up to 256 levels by as much a level.
ROUNDING = 2.0**-40


@inlined
def row_of(n, m):
    """The row of the real coefficient of order n and degree m; the imaginary one follows if m > 0."""
    return COEFFICIENTS + n - 1 if m == 0 else COEFFICIENTS + ORDER + (m - 1) * (2 * ORDER + 2 - m) + 2 * (n - m)


@inlined
def sum_lanes(four):
    """The sum of four float64."""
    return (extract(four, 0) + extract(four, 1)) + (extract(four, 2) + extract(four, 3))


@inlined
def see_octants(rows, base, point, share):
    """A node's octants, whose rows begin at ``base``, seen from a point: bits, winding numbers and their bounds, four
    sums.

    The bits are of octants too near: their bound exceeds ``share`` of their size over the squared distance.
    """
    low, values, bounds = _see_four(rows, base, point, share)
    high, more_values, more_bounds = _see_four(rows, base + 4, point, share)
    return low | (high << 4), values + more_values, bounds + more_bounds


@inlined
def _see_four(rows, base, point, share):
    x, y = splat4(point.x) - load4(rows, base + 8 * X), splat4(point.y) - load4(rows, base + 8 * Y)
    z = splat4(point.z) - load4(rows, base + 8 * Z)
    zero, one, radius = splat4(0.0), splat4(1.0), load4(rows, base + 8 * RADIUS)
    square = x * x + y * y + z * z
    q = radius / square_root(square)
    power, q2 = one, q * q
    for _ in range(ORDER // 2):
        power = power * q2
    gap = (one - q) * (one - q)
    remainder = load4(rows, base + 8 * SPREAD) * power * (splat4(ORDER + 1.0) - splat4(ORDER * 1.0) * q) / gap
    far = (q < splat4(_NEAREST)) & (remainder <= splat4(share))
    bits = movemask(far)
    if bits == 0:
        return np.int64(15), zero, zero
    part = radius / square
    value = q * _harmonics(rows, base, x * part, y * part, z * part, q2)
    bound = q2 * load4(rows, base + 8 * SIZE) * (remainder + splat4(ROUNDING))
    return 15 & ~bits, select(far, value, zero), select(far, bound, zero)


@inlined
def _harmonics(rows, base, x, y, z, square):
    """The sum over orders and degrees of coefficients and solid harmonics at (x, y, z), whose square is given."""
    total, _ = _degree(rows, base, 0, z, square)
    real, imaginary = x, y
    for m in range(1, ORDER + 1):
        along, across = _degree(rows, base, m, z, square)
        total = total + (along * real + across * imaginary)
        real, imaginary = real * x - imaginary * y, real * y + imaginary * x
    return total


@inlined
def _degree(rows, base, m, z, square):
    """The sums over the orders of one degree, real and imaginary, by Clenshaw's recurrence."""
    zero = splat4(0.0)
    a, b, c, d = zero, zero, zero, zero
    for n in range(ORDER, m - 1, -1):
        back = splat4(_back(n + 2, m)) * square
        x, y = zero, zero
        if n > 0:
            x = load4(rows, base + 8 * row_of(n, m))
        if m > 0:
            y = load4(rows, base + 8 * row_of(n, m) + 8)
        a, b = x + z * a - back * b, a
        c, d = y + z * c - back * d, c
    return a, c


@inlined
def _back(n, m):
    """Harmonics with a leading coefficient of 1 obey H(n) = z H(n - 1) - back(n) square H(n - 2)."""
    return ((n - 1.0) * (n - 1.0) - m * m) / ((2.0 * n - 1.0) * (2.0 * n - 3.0))


# A series as it is made: [n, m] complex, m from 0 to n, the rest 0. By the operator ``_lifted`` with a vector v, a
# product with v . w for any w whose square is 0, order n comes from order n - 1: v lifts the harmonics of a point times
# n - 1 to those of n, and a dipole v at the point has the series that v lifts from the point's.


@inlined
def _lifted(series, n, m, v):
    """Degree m of order n of what the vector lifts."""
    slope = complex(v[0], v[1])
    if m == 0:
        return v[2] * series[n - 1, 0] - (slope.conjugate() * series[n - 1, 1]).real
    return v[2] * series[n - 1, m] + 0.5 * (slope * series[n - 1, m - 1] - slope.conjugate() * series[n - 1, m + 1])


@kernel
def add_face(series, a, b, c, area, work):
    """Add the series of a face with this area vector; its corners a, b and c are relative to the centre.

    The mean of (y . w)^k over the face is 2 k! / (k + 2)! times the sum of all products of degree k of the corners;
    these are added corner by corner.
    """
    work[:] = 0.0
    work[0, 0] = 1.0
    _multiply(work, a)
    _multiply(work, b)
    _multiply(work, c)
    share = 1.0
    for n in range(1, ORDER + 1):
        for m in range(n + 1):
            series[n, m] += share * _lifted(work, n, m, area)
        share /= n + 2.0


@kernel
def _multiply(series, v):
    """Multiply a series by 1 / (1 - v . w) = 1 + v . w + (v . w)^2 ..., up to its last order."""
    for n in range(1, ORDER):
        for m in range(n + 1):
            series[n, m] += _lifted(series, n, m, v)


@kernel
def add_shifted(series, other, shift, work):
    """Add a series whose centre lies at ``shift`` from that of ``series``: multiplied by exp(shift . w)."""
    # Begin with the series as it is.
    for n in range(1, ORDER + 1):
        for m in range(n + 1):
            work[n, m] = other[n, m]
    # Multiply by Horner's rule: exp(x) = 1 + x (1 + x/2 (1 + x/3 ...)), where x = shift . w lifts each order by one.
    # Go from the highest order down, so that each is read before it changes.
    for k in range(ORDER - 1, 0, -1):
        for n in range(ORDER, 1, -1):
            for m in range(n + 1):
                work[n, m] = other[n, m] + _lifted(work, n, m, shift) / k
    # Add the product.
    for n in range(1, ORDER + 1):
        for m in range(n + 1):
            series[n, m] += work[n, m]


@kernel
def put_series(rows, base, series):
    """Write a series, with lengths in units of the radius, as the coefficients of the octant at ``base``."""
    factor = -1.0 / (4.0 * math.pi)
    for n in range(1, ORDER + 1):
        factor *= 2.0 * n - 1.0
        store(rows, base + 8 * row_of(n, 0), factor * series[n, 0].real)
        for m in range(1, n + 1):
            store(rows, base + 8 * row_of(n, m), 2.0 * factor * series[n, m].real)
            store(rows, base + 8 * row_of(n, m) + 8, 2.0 * factor * series[n, m].imag)


@kernel
def get_series(rows, base, ratio, series):
    """The series of the octant at ``base`` in units of another radius; ``ratio`` is its own over that."""
    factor, scale = -4.0 * math.pi, ratio
    for n in range(1, ORDER + 1):
        factor /= 2.0 * n - 1.0
        scale *= ratio
        series[n, 0] = factor * scale * load(rows, base + 8 * row_of(n, 0))
        for m in range(1, n + 1):
            real, imaginary = load(rows, base + 8 * row_of(n, m)), load(rows, base + 8 * row_of(n, m) + 8)
            series[n, m] = 0.5 * factor * scale * complex(real, imaginary)
