"""``python -m renderer`` is the command ``octree-render``."""

import sys

from renderer.cli.main import main

sys.exit(main())
