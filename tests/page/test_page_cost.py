"""What a ray costs, on the page: legends of the heat maps, and the card of a clicked pixel's rays."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from cases import cases
from viewer_page import Viewer


@pytest.fixture(scope="module")
def page(browser: Any, url: str) -> Iterator[Viewer]:
    with Viewer(browser, url, viewport={"width": 900, "height": 640}).open() as page:
        yield page


@cases("aov", ["depth", "cost", "nodes", "triangles"])
def test_a_legend_shows_the_scale_of_colours(page: Viewer, aov: str) -> None:
    assert page.page.is_hidden("#legend")
    page.page.select_option("[name=aov]", aov)
    page.settled("octree")
    low, high = page.page.evaluate("() => [viewer.traced.shown.view.legend.low, viewer.traced.shown.view.legend.high]")
    ends = page.page.locator("#legend .ends span").all_inner_texts()
    assert float(ends[0].replace(",", "")) == pytest.approx(low, rel=1e-3)
    assert float(ends[-1].split()[0].replace(",", "")) == pytest.approx(high, rel=1e-3)
    assert "gradient" in page.page.evaluate(
        "() => getComputedStyle(document.querySelector('#legend .scale')).backgroundImage"
    )
    page.page.select_option("[name=aov]", "color")
    page.settled("octree")
    assert page.page.is_hidden("#legend")


def test_the_card_lists_all_rays_and_what_is_pointed_at_stands_out(page: Viewer) -> None:
    x, y = page.centre()
    page.page.mouse.click(x + 90, y + 60)
    page.page.wait_for_selector("#card:not([hidden]) .rays")
    rays = page.page.evaluate("() => viewer.rays.pick.path.map(({ kind, depth }) => [kind, depth])")
    rows = page.page.locator("#card .rays button")
    assert rows.count() == len(rays) > 2
    for (kind, _), text in zip(rays, rows.all_inner_texts(), strict=True):
        assert kind in text and "%" in text
    plain = page.pixels("gl")
    rows.nth(1).hover()
    page.page.wait_for_timeout(100)
    assert not np.array_equal(page.pixels("gl"), plain)
    for _ in range(3):
        page.page.get_by_label("Next ray").click()
        chosen = page.page.locator("#card .rays [aria-current]")
        assert chosen.count() == 1
    assert page.page.inner_text("#card .steps").split()[1] in ("3", "4")
    assert page.page.locator("#card .by-level i").count() == len(page.page.evaluate("() => viewer.rays.pick.levels"))
    page.page.locator("#stage").press("Escape")
