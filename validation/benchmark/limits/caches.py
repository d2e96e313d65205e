"""A model of the processor's caches: which level each record that rays read comes from."""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel
from validation.benchmark.limits.trees import NODE_BYTES, PlainTree

LINE = 64
_FOLDER = Path("/sys/devices/system/cpu/cpu0/cache")
# Where the system does not tell: bytes and ways of the first, second and last cache of a common server.
_USUAL = ((48 << 10, 12), (1 << 20, 16), (32 << 20, 16))


class Caches(NamedTuple):
    """Sizes in bytes, and ways, of the data caches from the nearest on; and whether the system told them."""

    levels: tuple[tuple[int, int], ...]
    told: bool


class Reads(NamedTuple):
    """What the records of a walk come to.

    lines    lines read, each time that a record is
    from_    lines that came from each cache, then from memory, (levels + 1,)
    waits    records whose farthest line came from each of these
    """

    lines: int
    from_: NDArray[np.int64]
    waits: NDArray[np.int64]


def caches() -> Caches:
    """The data caches of this machine's first processor."""
    found = []
    for index in sorted(_FOLDER.glob("index*")) if os.name == "posix" else []:
        try:
            kind, size, ways = (
                (index / name).read_text().strip() for name in ("type", "size", "ways_of_associativity")
            )
            if kind != "Instruction":
                found.append((int(size.removesuffix("K")) << 10, int(ways)))
        except (OSError, ValueError):
            return Caches(_USUAL, False)
    return Caches(tuple(found), True) if found and all(ways > 0 for _, ways in found) else Caches(_USUAL, False)


def reads(tree: PlainTree, records: NDArray[np.int64], warm: int, levels: tuple[tuple[int, int], ...]) -> Reads:
    """Where ``records[warm:]`` come from, after ``records[:warm]`` were read: each level forgets what was used longest
    ago, of each set.
    """
    sets = np.array([size // (LINE * ways) for size, ways in levels], np.int64)
    ways = np.array([ways for _, ways in levels], np.int64)
    tags = np.full((len(levels), int(sets.max()), int(ways.max())), -1, np.int64)
    blocks_at = len(tree.boxes) * NODE_BYTES
    out = np.zeros((3, len(levels) + 1), np.int64)
    _read((records, warm), (NODE_BYTES, blocks_at, tree.block_bytes), (sets, ways, tags), out)
    return Reads(int(out[2, 0]), out[0], out[1])


@kernel
def _read(walk, memory, caches, out):
    records, warm = walk
    node_bytes, blocks_at, block_bytes = memory
    levels = len(caches[0])
    for k in range(len(records)):
        number, size, begin = records[k] >> 1, node_bytes, (records[k] >> 1) * node_bytes
        if records[k] & 1:
            size, begin = block_bytes, blocks_at + number * block_bytes
        farthest = 0
        for line in range(begin // LINE, (begin + size - 1) // LINE + 1):
            level = 0
            while level < levels and not _touch(line, level, caches):
                level += 1
            farthest = max(farthest, level)
            if k >= warm:
                out[0, level] += 1
                out[2, 0] += 1
        if k >= warm:
            out[1, farthest] += 1


@kernel
def _touch(line, level, caches):
    """Whether a cache has a line; it is then the one used last, in either case."""
    sets, ways, tags = caches
    row, way = tags[level, line % sets[level]], 0
    last = ways[level] - 1
    while way < last and row[way] != line:
        way += 1
    had = row[way] == line
    while way > 0:
        row[way] = row[way - 1]
        way -= 1
    row[0] = line
    return had
