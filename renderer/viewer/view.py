"""``view``: a scene in, and the interactive viewer at work."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from renderer.errors import expect, extra_hint
from renderer.scene.scene import Scene

if TYPE_CHECKING:
    from renderer.viewer.server import ViewerServer


def view(
    scene: Scene | str | Path, *, host: str = "127.0.0.1", port: int = 0, browser: bool | None = None
) -> "ViewerServer":
    """Show ``scene``, or a scene file, in the interactive viewer, and return at once.

    host     the address to listen on; one that other machines reach takes a token, which ``url`` then holds
    port     0 takes a free one
    browser  whether to open a browser; by default unless this is a notebook, which shows the result inline

    The result has ``url`` and ``close()``; the server ends with it or with the process. Raises ``ValueError`` naming
    the argument, and ``ModuleNotFoundError`` where the extra ``viewer`` is not installed.

    >>> from renderer import view
    >>> viewing = view("scenes/stairs.toml", browser=False)
    >>> viewing.url.startswith("http://127.0.0.1:")
    True
    >>> viewing.close()
    """
    expect(isinstance(scene, Scene | str | Path), "scene", "a Scene or a path", type(scene).__name__)
    try:
        from renderer.viewer.server import ViewerServer
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        told = f"the viewer needs the package {package}; {extra_hint('viewer')}"
        raise ModuleNotFoundError(told, name=package) from None
    from renderer.precompile import compile_in_two
    from renderer.viewer.shown import open_file, prepare_shown

    compile_in_two()
    shown = prepare_shown(scene) if isinstance(scene, Scene) else open_file(Path(scene))
    notebook = in_notebook()
    viewing = ViewerServer(shown, host, port, framed=notebook)
    if browser if browser is not None else not notebook:
        viewing.open_browser()
    return viewing


def in_notebook() -> bool:
    """Whether this process is a notebook's kernel."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return getattr(shell, "kernel", None) is not None
