"""The memory of the viewer's page is bounded: it does not grow with what its user does."""

from typing import Any

from viewer_page import Viewer

_DRAGS = 12
_LOOKS = 5
_WIDTH, _HEIGHT = 640, 400


def held(page: Viewer, connection: Any) -> float:
    """Bytes of what scripts hold, buffers of pictures and meshes with it, once what is left over is collected: the
    least of some looks, because what the engine paints between a collection and a look is gone at the next.
    """

    def look() -> float:
        page.page.wait_for_timeout(50)
        connection.send("HeapProfiler.collectGarbage")
        heap = connection.send("Runtime.getHeapUsage")
        return heap["usedSize"] + heap["backingStorageSize"] + heap["embedderHeapUsedSize"]

    return min(look() for _ in range(_LOOKS))


def test_drags_and_clicks_leave_nothing_behind(browser: Any, url: str) -> None:
    """A page that kept one picture a drag, would hold twelve pictures more; what
    the engine itself notes of code that it has seen often is far below one picture.
    """
    with Viewer(browser, url, viewport={"width": _WIDTH, "height": _HEIGHT}, folded=True).open() as page:
        connection = page.context.new_cdp_session(page.page)
        connection.send("HeapProfiler.enable")

        def drags() -> float:
            for number in range(_DRAGS):
                page.drag((-1) ** number * 40, 10)
                page.settled("octree")
                page.pick(*page.centre())
            return held(page, connection)

        drags()
        before, after = drags(), drags()
        width, height = page.page.evaluate("() => [viewer.traced.shown.w, viewer.traced.shown.h]")
    assert after - before < 4 * width * height
