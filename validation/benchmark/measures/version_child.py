"""One version of the renderer in a process of its own, which answers the questions of ``versions``.

Run as a file, with the folder that has this version's package, a mesh (.npz) and rays (.npz). It reads lines of JSON,
(query, threads), and for each writes the digest of the answer and the seconds that it took. It imports nothing of this
checkout, which may be of another version.
"""

import hashlib
import json
import sys
import time
from typing import Any


def serve(folder: str, mesh: str, lines: Any, out: Any) -> None:
    """Answer each line: {"rays": path, "query": "closest" or "any", "threads": n}."""
    sys.path.insert(0, folder)
    import numpy as np

    from renderer import Octree

    with np.load(mesh) as of:
        octree = Octree(of["vertices"], of["faces"])
    rays: dict[str, tuple[Any, ...]] = {}
    for line in lines:
        asked = json.loads(line)
        if asked["rays"] not in rays:
            with np.load(asked["rays"]) as of:
                rays[asked["rays"]] = of["origins"], of["directions"], 0.0, float(of["t_max"])
        octree.threads = asked["threads"]
        query: Any = octree.closest_hit if asked["query"] == "closest" else octree.any_hit
        began = time.perf_counter()
        found = query(*rays[asked["rays"]])
        seconds = time.perf_counter() - began
        out.write(json.dumps([_digest(found), seconds]) + "\n")
        out.flush()


def _digest(found: Any) -> str:
    """A digest of the bits of an answer."""
    arrays = [found] if hasattr(found, "tobytes") else [found.t, found.face, found.u, found.v]
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()


if __name__ == "__main__":
    serve(sys.argv[1], sys.argv[2], sys.stdin, sys.stdout)
