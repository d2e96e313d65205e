"""``view``: a scene in, and the interactive viewer at work."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from renderer.errors import expect, extra_hint
from renderer.scene.scene import Scene

if TYPE_CHECKING:
    from renderer.viewer.server import ViewerServer


def view(
    scene: Scene | str | os.PathLike[str],
    *,
    up: Literal["x", "y", "z"] | None = None,
    host: str = "127.0.0.1",
    port: int = 0,
    browser: bool | None = None,
) -> "ViewerServer":
    """Show a scene in the interactive viewer, and return at once.

    Parameters
    ----------
    scene : Scene or path
        The scene, or a scene file or mesh file as of ``load_scene``.
    up : {"x", "y", "z"}, optional
        The axis of a mesh file that points up, by default "y".
    host : str, default "127.0.0.1"
        The address to listen on. One that other machines reach needs a token, which ``url`` then has.
    port : int, default 0
        The port; 0 is any free one.
    browser : bool, optional
        Whether to open a browser. By default it opens, except in a notebook, which shows the viewer in its cell.

    Returns
    -------
    ViewerServer
        Its ``url`` is the address; ``close()`` ends the server, which also ends with the process.

    Raises
    ------
    ValueError
        For a bad argument, which the message names.
    ModuleNotFoundError
        Where the extra ``viewer`` is not installed.

    Examples
    --------
    >>> from renderer import view
    >>> viewing = view("scenes/stairs.toml", browser=False)
    >>> viewing.url.startswith("http://127.0.0.1:")
    True
    >>> viewing.close()
    """
    expect(isinstance(scene, Scene | str | os.PathLike), "scene", "a Scene or a path", type(scene).__name__)
    expect(up is None or not isinstance(scene, Scene), "up", "None for a Scene, which has its own", repr(up))
    try:
        from renderer.viewer.server import ViewerServer
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        told = f"the viewer needs the package {package}; {extra_hint('viewer')}"
        raise ModuleNotFoundError(told, name=package) from None
    from renderer.precompile import compile_in_two
    from renderer.viewer.shown import open_file, prepare_shown

    compile_in_two()
    shown = prepare_shown(scene) if isinstance(scene, Scene) else open_file(Path(scene), up)
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
