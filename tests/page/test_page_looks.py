"""How the page looks: what axe-core finds, contrasts that are measured, and that nothing is cut off."""

from pathlib import Path
from typing import Any

import pytest
from cases import cases
from viewer_page import Viewer

# A phone, a small window, and a large screen.
SIZES = [(320, 568), (390, 844), (800, 600), (1280, 800), (2560, 1440)]

CONTRASTS = (Path(__file__).parent / "contrasts.js").read_text()


def opened(browser: Any, url: str, scheme: str = "dark", size: tuple[int, int] = (1280, 800), **more: Any) -> Viewer:
    viewport = {"width": size[0], "height": size[1]}
    return Viewer(browser, url, color_scheme=scheme, viewport=viewport, **more).open()


def coarse(page: Viewer) -> None:
    """Pictures of a quarter of the pixels a side, which stand where whole ones do: a comparison has 64 samples each."""
    page.page.evaluate("() => (viewer.panel.fields.size.value = '0.25', viewer.changed('size'))")
    page.settled("octree")


def unfold(page: Viewer) -> None:
    """Everything that can be opened is open, and a ray is followed."""
    page.page.evaluate("() => document.querySelectorAll('details').forEach((one) => (one.open = true))")
    page.page.mouse.click(*page.centre())
    page.page.wait_for_selector("#card:not([hidden])")


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_contrasts_are_large_enough(browser: Any, url: str, scheme: str) -> None:
    with opened(browser, url, scheme) as page:
        unfold(page)
        page.page.evaluate("() => viewer.notices.say('A notice.')")
        found = page.page.evaluate(CONTRASTS)
        # WCAG 2.2: 1.4.3 for text of this size, 1.4.11 for what is needed to understand a control.
        least = {"text": 4.5, "edge": 3.0, "switch": 3.0}
        assert {kind for kind, *_ in found} == set(least) and len(found) > 100
        assert [(kind, round(value, 2), name) for kind, value, name in found if value < least[kind]] == []
        # The measure itself: black on white, and grey on nearly the same grey.
        page.page.evaluate("() => document.querySelector('#hud').style.cssText = 'color: #777; background: #888'")
        assert any(value < 1.3 for _, value, name in page.page.evaluate(CONTRASTS) if "#hud" in name)


def violations(page: Viewer) -> list[str]:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    found = axe.Axe().run(page.page).response["violations"]
    return [f"{fault['id']}: {node['html'][:120]}" for fault in found for node in fault["nodes"]]


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_axe_finds_nothing(browser: Any, url: str, scheme: str) -> None:
    with opened(browser, url, scheme, folded=True) as page:
        assert violations(page) == []
        unfold(page)
        assert violations(page) == []
        coarse(page)
        page.choose("proof")
        assert violations(page) == []
        page.page.click("#save-scene")
        page.page.wait_for_selector("#changes[open]")
        assert violations(page) == []
        page.page.click("#close-changes")
        # The checker itself: a button without a name.
        page.page.evaluate("() => document.querySelector('#fit').replaceChildren()")
        page.page.evaluate("() => document.querySelector('#fit').removeAttribute('title')")
        assert any(fault.startswith("button-name") for fault in violations(page))


# Controls and texts that reach out of the window, or that are cut off where they cannot be scrolled.
CUT = """() => [...document.querySelectorAll("button, select, input, summary, .hud, .hint, .modes span, #card, #panel")]
    .filter((one) => one.checkVisibility({ visibilityProperty: true }))
    .filter((one) => {
        // What can be scrolled to is not cut off.
        const bar = one.closest(".bar"), scrolls = bar && getComputedStyle(bar).overflowX === "auto";
        const { left, right } = (scrolls ? bar : one).getBoundingClientRect();
        const cut = one.matches(".modes span, .bar button, .hud, .hint") && one.scrollWidth > one.clientWidth + 1;
        return left < 0 || right > innerWidth + 0.5 || cut;
    }).map((one) => one.id || one.name || one.innerText.slice(0, 20))"""


@cases("size", SIZES)
def test_nothing_is_cut_off_at_any_width(browser: Any, url: str, size: tuple[int, int]) -> None:
    touch = {"has_touch": True, "is_mobile": True} if size[0] < 500 else {}
    with opened(browser, url, size=size, **touch) as page:
        for _ in range(2):
            assert page.page.evaluate("() => document.documentElement.scrollWidth") == size[0]
            assert page.page.evaluate(CUT) == []
            unfold(page)
        for button in ("#reset-view", "#fit", "#save-picture"):  # at once, without scrolling
            assert page.page.locator(button).bounding_box()["y"] < size[1] - 20, button
        # The picture has most of the window, or of the first screen of a phone.
        box = page.page.locator("#frame").bounding_box()
        assert box["width"] * min(box["height"], size[1]) >= 0.4 * size[0] * size[1]


def overlapping(page: Viewer, names: list[str]) -> list[tuple[str, str]]:
    boxes = {name: page.page.locator(name).bounding_box() for name in names if page.page.is_visible(name)}

    def apart(a: Any, b: Any) -> bool:
        beside = a["x"] + a["width"] <= b["x"] or b["x"] + b["width"] <= a["x"]
        return beside or a["y"] + a["height"] <= b["y"] or b["y"] + b["height"] <= a["y"]

    return [(a, b) for a in boxes for b in boxes if a < b and not apart(boxes[a], boxes[b])]


# Where the divider's handle begins and ends, from top to bottom.
HANDLE = """() => {
    const divider = document.querySelector("#divider");
    const [top, height] = ["top", "height"].map((name) => parseFloat(getComputedStyle(divider, "::after")[name]));
    const begin = divider.getBoundingClientRect().top + top;
    return [begin, begin + height];
}"""


@cases("size", [(320, 568), (800, 600), (1400, 900)])
def test_what_stands_on_the_picture_does_not_overlap(browser: Any, url: str, size: tuple[int, int]) -> None:
    with opened(browser, url, size=size, folded=True) as page:
        coarse(page)
        page.page.evaluate("() => viewer.notices.say('A notice that says a word or two.')")
        names = ["#axes", "#scale", "#pointed", "#bar", "#hud", "#hint", "#legend", "#proof", "#notices p", "#progress"]
        assert overlapping(page, names) == []
        page.page.evaluate("() => (viewer.panel.fields.aov.value = 'depth', viewer.changed('aov'))")
        page.page.wait_for_selector("#legend:not([hidden])")
        page.settled("octree")
        page.page.mouse.move(*page.centre())
        page.page.wait_for_function("() => document.querySelector('#pointed').textContent")
        assert overlapping(page, names) == []
        # A proof that takes its time: the line that stands for it is shown whatever this machine needs.
        page.page.evaluate("() => (viewer.panel.fields.aov.value = 'color', viewer.changed('aov'))")
        page.choose("proof")
        page.page.evaluate("() => (document.querySelector('#progress').hidden = false)")
        names += [".way:not(.right)", ".way.right"]
        assert overlapping(page, names) == []
        top, bottom = page.page.evaluate(HANDLE)
        box = page.page.locator("#progress").bounding_box()
        assert box["y"] >= bottom or box["y"] + box["height"] <= top
        x, y = page.centre()
        page.page.mouse.click(x + 40, y)  # beside the divider
        page.page.wait_for_selector("#card:not([hidden])")
        assert overlapping(page, [*names, "#card"]) == []
        page.page.click("#card .close")
        page.page.locator("#stage").press("x")
        page.page.wait_for_selector("#legend:not([hidden])")
        assert overlapping(page, names) == []
