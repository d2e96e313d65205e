"""``python -m renderer`` is the command ``octree-render``."""

import sys

from renderer.cli import main

sys.exit(main())
