"""The targets that the rays of a row hit: each once, with its number of rays and its error."""

import math

from renderer.jit.decorators import kernel
from renderer.studies.factors.aim import REPLICATES

# Targets after the last surface.
SKY, BACK = 0, 1
# A count is a whole number: no entry is known better than half a ray.
_HALF = 0.5


@kernel
def write_keys(left, faces, sides, of_face, both, twin, covered, number, begin, keys):
    """Write the keys of ``tally_rows`` for the rays from ``begin`` on of some rows.

    left           (n * rows,) int64: the face that each ray left, -1 for none
    faces, sides   (n * rows,) int64: what each ray hit, -1 for nothing, and from which side; the first ray of each row,
                   then the second of each, and so on
    of_face, both, twin, covered
                   as of ``Surfaces``; ``number`` of them
    keys           (rows, n) int64
    """
    rows, count = keys.shape
    for k in range(count):
        for row in range(rows):
            i = k * rows + row
            face, own = faces[i], left[i]
            # rule: sky-of-row
            target = number + SKY
            # Of the two sides of a plate, the ray sees the one that it comes to.
            back = face >= 0 and sides[i] < 0 and not both[face]
            if back and twin[face] >= 0:
                face, back = twin[face], False
            if face >= 0:
                # rule: backs-of-faces
                seen = not back and not covered[face]
                target = of_face[face] if seen else number + BACK
            if own >= 0 and covered[own]:
                target = number + BACK
            keys[row, k] = target * REPLICATES + (begin + k) % REPLICATES


@kernel
def tally_rows(keys, known_first, known, rtol, last, targets, counts, errors, lengths, unfinished):
    """Count the hits of some rows, and write those of the rows that need no more rays, one row after the other.

    keys         (rows, n) int64, sorted: target * REPLICATES + the number of the sequence that the ray belongs to
    known_first  (rows + 1,) int64, known (...) int64: the targets of each row, sorted, that need no rays
    rtol         as of ``view_factors``
    last         whether no row gets more rays
    targets, counts, errors
                 (rows * n,): the targets of each row that do; how many rays hit them; the standard error of that number
                 over n
    lengths      (rows,) int64: how many targets they are
    unfinished   (rows,) bool: whether the root of the sum of the squared errors is above rtol, or all rays hit known
                 targets, which are not all there is

    Returns how many targets are written.
    """
    rays, written = keys.shape[1], 0
    for row in range(len(keys)):
        at, begin, length, variance = known_first[row], 0, 0, 0.0
        while begin < rays:
            target, end, squares = keys[row, begin] // REPLICATES, begin, 0.0
            while end < rays and keys[row, end] // REPLICATES == target:
                run = end
                while end < rays and keys[row, end] == keys[row, run]:
                    end += 1
                squares += float(end - run) ** 2
            count = end - begin
            while at < known_first[row + 1] and known[at] < target:
                at += 1
            if at == known_first[row + 1] or known[at] != target:
                # rule: error-of-replicates
                spread = (squares - float(count) ** 2 / REPLICATES) * REPLICATES / (REPLICATES - 1)
                error = math.sqrt(max(spread, _HALF * _HALF)) / rays
                i = written + length
                targets[i], counts[i], errors[i] = target, count, error
                variance, length = variance + error * error, length + 1
            begin = end
        lengths[row], unfinished[row] = length, (variance > rtol * rtol or length == 0) and not last
        if not unfinished[row]:
            written += length
    return written
