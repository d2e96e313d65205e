"""``octree-render view``: a scene in the browser, live."""

import argparse
from contextlib import suppress
from typing import Any

from renderer.cli.scene import add_scene, say_up, write_scene_of
from renderer.system.terminal import say


def add_view(commands: Any) -> None:
    """Add the command to a parser's ``commands``."""
    view = commands.add_parser("view", help="show a scene in the browser, live")
    add_scene(view)
    view.add_argument(
        "--host", default="127.0.0.1", help="the address to listen on; one that other machines reach needs a token"
    )
    view.add_argument("--port", type=int, default=0, help="default: 0, any free port")
    view.add_argument("--no-browser", action="store_true", help="print the address, and open no browser")
    view.set_defaults(command=_view)


def _view(options: argparse.Namespace) -> None:
    from renderer.viewer.view import view

    write_scene_of([options.scene], options)
    served = view(options.scene, up=options.up, host=options.host, port=options.port, browser=False)
    # Ctrl-C is the usual way to end it, so no failure, from the moment on that the address stands there.
    with served as viewing, suppress(KeyboardInterrupt):
        say_up([options.scene], options.up)
        say(f"{options.scene} is shown at {viewing.url} until Ctrl-C", flush=True)
        if not options.no_browser:
            viewing.open_browser()
        viewing.wait()
