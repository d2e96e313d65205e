"""The command ``python tests/fuzz``."""

import sys
from pathlib import Path

# Python puts this folder first on the path, where ``files`` and ``values`` would be modules of their own.
sys.path[0] = str(Path(__file__).resolve().parents[1])

from fuzz.run import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
