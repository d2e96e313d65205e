"""The example of a quarter: what it writes, and figures that geometry gives without a ray."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image as Pillow

from renderer import load_mesh


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_quarter", Path(__file__).parents[2] / "scenes/make_quarter.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def written(example: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("quarter")
    assert example.main([str(folder), "--buildings", "10"]) == 0
    return folder


def test_figures_are_those_of_geometry_and_pictures_show_the_quarter(example: ModuleType, written: Path) -> None:
    mesh, kinds = example.quarter(10)
    sky, sun = np.load(written / "sky.npy"), np.load(written / "sun.npy")
    assert len(sky) == len(sun) == len(kinds) == len(mesh.faces)
    (_, flat, one), (_, pitched, tilted), (_, facade, half), (_, hours, day) = example.figures(kinds, sky, sun)
    # Level points and walls in the open have these but for rounding, whatever the patches; one that is tilted is cut
    # through patches, of which 145 have 1/145 of the sky each; and a sun stands for ten minutes.
    # Coordinates of 5e6 m have steps of 1e-9 m, by which walls of 3 m are not upright.
    assert flat == pytest.approx(one, abs=1e-12) and facade == pytest.approx(half, abs=1e-9)
    assert pitched == pytest.approx(tilted, abs=1 / 145) and hours == pytest.approx(day, abs=1 / 6)
    # Here too, because what is written serves both.
    read = load_mesh(written / "quarter.ply")
    assert (read.bounds[0] > [690_000, 5_334_000, 518]).all() and (read.bounds[1] < [692_000, 5_336_000, 700]).all()
    for name in ("sky", "sun", "sky-streets", "sun-streets"):
        picture = np.array(Pillow.open(written / f"{name}.png"))
        # Of the pixels above the legend, some show the quarter, in more than a few colours.
        assert picture.shape[1:] == (960, 3) and len(np.unique(picture[:720] @ [1, 256, 65_536])) > 100


def test_the_suns_are_those_of_the_shortest_day(example: ModuleType) -> None:
    suns = example.suns()
    np.testing.assert_allclose(np.linalg.norm(suns[:, :3], axis=1), 1)
    noon = suns[np.argmax(suns[:, 2])]
    # At noon 90 - 48.14 - 23.44 degrees high, in the south; it rises east of it and sets west, and days are symmetric.
    assert np.degrees(np.arcsin(noon[2])) == pytest.approx(18.42, abs=0.05) and noon[1] < 0
    assert suns[0, 0] > 0 > suns[-1, 0]
    np.testing.assert_allclose(suns[:, 2], suns[::-1, 2])
