"""Distances of points that were clicked on, judged by exact arithmetic."""

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from viewer_client import SIZE, Client, looking
from viewer_page import SCENE

from renderer.viewer.measure import distance_of, measured, spot_at
from renderer.viewer.passes import Pass, picture
from renderer.viewer.protocol import Measure, Pixel, parse
from renderer.viewer.shown import ShownScene, open_file
from renderer.viewer.viewpoint import ray_through
from validation.oracle import exact
from validation.oracle.vectors import difference, dot

# A place as survey coordinates have it, in metres: an ulp is a nanometre there.
FAR = (500000.3, 0.0, 5400000.7)
# Pixels of pictures of 200 x 150 that see the stairs, the glass or the floor.
PLACES = [(70, 60), (140, 100), (100, 130), (60, 75)]


def moved(place: tuple[float, float, float]) -> str:
    """The scene's two models at a place, whose floor is left out."""
    x, y, z = place
    text = SCENE.partition("[floor]")[0]
    for old in ("[-0.8, 0.0, -0.3]", "[0.8, 0.01, 0.6]"):
        dx, dy, dz = json.loads(old)
        text = text.replace(f"translate = {old}", f"translate = [{x + dx!r}, {y + dy!r}, {z + dz!r}]")
    eye, target = ([a + b for a, b in zip(p, place, strict=True)] for p in ((0.5, 2.6, 5.5), (0.0, 0.5, 0.0)))
    return text.replace("[0.5, 2.6, 5.5]", repr(eye)).replace("[0.0, 0.5, 0.0]", repr(target))


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ShownScene]:
    folder = tmp_path_factory.mktemp("measured")
    for name, text in (("near", SCENE), ("far", moved(FAR))):
        (folder / f"{name}.toml").write_text(text)
    return {name: open_file(folder / f"{name}.toml") for name in ("near", "far")}


def view_of(shown: ShownScene, turned: float = 0.0) -> dict[str, Any]:
    """The scene's camera as a page has it, moved to the right."""
    camera = shown.scene.camera
    right, up, forward = camera.frame()
    eye = (np.array(camera.eye) + turned * right).tolist()
    return {"m": [*right, 0.0, *up, 0.0, *-forward, 0.0, *eye, 1.0], "fovy": 0.66, **SIZE}


def pairs(shown: ShownScene, kind: str) -> list[tuple[Pixel, Pixel]]:
    """Pixels of one view, of two, or of one whose rays are parallel."""
    one, other = view_of(shown), view_of(shown, 0.3 if kind == "two views" else 0.0)
    if kind == "orthographic":
        one, other = one | {"height": 3.0}, other | {"height": 3.0}
    made = [[Pixel(x=x, y=y, **view) for x, y in PLACES] for view in (one, other)]
    return [(a, b) for i, a in enumerate(made[0]) for j, b in enumerate(made[1]) if i != j]


def exact_point(shown: ShownScene, pixel: Pixel) -> list[Fraction]:
    """Where the float64 ray first meets the float64 mesh."""
    origin, direction = ray_through(pixel)
    mesh = shown.prepared.octree.mesh
    (hit,) = exact.closest_hits(mesh.vertices, mesh.faces, origin[None], direction[None])
    assert hit is not None
    return [Fraction(o) + hit.t * Fraction(d) for o, d in zip(origin.tolist(), direction.tolist(), strict=True)]


def within(vector: list[float], length: float, bound: Fraction, true: list[Fraction]) -> bool:
    """Whether vector and length are those of ``true`` to the bound."""
    apart = [abs(Fraction(x) - y) for x, y in zip(vector, true, strict=True)]
    least, most = max(Fraction(length) - bound, Fraction(0)), Fraction(length) + bound
    return max(apart) <= bound and least**2 <= dot(true, true) <= most**2


@cases("kind", ["one view", "two views", "orthographic"])
@cases("where", ["near", "far"])
def test_a_distance_is_the_exact_one_to_its_bound(shown: dict[str, ShownScene], where: str, kind: str) -> None:
    here, naive, judged = shown[where], 0, 0
    for one, other in pairs(here, kind):
        spots = spot_at(here, one), spot_at(here, other)
        if None in spots:
            continue
        vector, length, bound = distance_of(*spots)
        true = difference(exact_point(here, other), exact_point(here, one))
        # As the page writes them, too: the shortest decimals that are read as these.
        assert within([Fraction(repr(x)) for x in vector], Fraction(repr(length)), Fraction(bound), true)
        assert 0.0 < bound < 1e-14
        rounded = np.subtract(*([float(x) for x in spot.point] for spot in reversed(spots)))
        naive += not within(rounded.tolist(), float(np.linalg.norm(rounded)), Fraction(bound), true)
        judged += 1
    assert judged >= 6
    # The judge: from rounded coordinates the digits are lost, far from the origin.
    assert (naive > 0) == (where == "far")


def test_the_ray_is_the_one_that_the_picture_traces(shown: dict[str, ShownScene]) -> None:
    for here in shown.values():
        view = parse(
            json.dumps({"type": "view", "seq": 1, "mode": "octree", "settings": {"aov": "depth"}, **view_of(here)})
        )
        depth = picture(here, view, Pass(0, True, (200, 150), 1)).depth
        found = [spot_at(here, Pixel(x=x, y=y, **view_of(here))) for x, y in PLACES]
        assert [np.inf if spot is None else spot.t for spot in found] == [depth[y, x] for x, y in PLACES]


def test_a_page_measures(client: Client, scene: Path) -> None:
    """The sky has no point, and a distance takes two."""
    view = looking((0.5, 2.6, 5.5)) | SIZE
    sky, *ground = ({"x": x, "y": y, **view} for x, y in [(3, 3), (140, 100), (100, 130)])
    asked = [[sky], [ground[0]], [ground[0], sky], ground]
    for seq, pixels in enumerate(asked):
        client.send(type="measure", seq=seq, pixels=pixels)
        told = client.told("measure")
        assert told["seq"] == seq and [point is None for point in told["points"]] == [p is sky for p in pixels]
        assert (told["distance"] is None) == (pixels is not ground)
    expected = measured(open_file(scene), Measure(type="measure", seq=3, pixels=[Pixel(**p) for p in ground]))
    assert told == expected | {"scene": told["scene"], "distance": expected["distance"]}
    assert told["distance"]["length"] == pytest.approx(np.linalg.norm(np.subtract(*told["points"])), rel=1e-12)
