"""Directions to the sun from azimuth and elevation, and tables of these."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.cli.main import main
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box
from renderer.studies import sun_directions, sun_hours
from renderer.studies.sun_files import suns_of

pytestmark = pytest.mark.judges("studies.sun_directions", "octree-render study --suns")

QUARTERS = np.arange(-8, 9) * 90.0
COMPASS = {0: (0.0, 1.0), 90: (1.0, 0.0), 180: (0.0, -1.0), 270: (-1.0, 0.0)}


def test_multiples_of_90_degrees_are_exact_and_run_clockwise_from_north() -> None:
    suns = sun_directions(QUARTERS, 0.0)
    assert suns.tolist() == [[*COMPASS[int(turn) % 360], 0.0] for turn in QUARTERS]
    assert not np.signbit(suns[suns == 0.0]).any()
    assert sun_directions(QUARTERS, 90.0).tolist() == [[0.0, 0.0, 1.0]] * len(QUARTERS)
    assert sun_directions(123.0, [-90.0, 90.0]).tolist() == [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]


def test_angles_are_those_of_the_vectors() -> None:
    rng = np.random.default_rng(5)
    azimuth, elevation = rng.uniform(-720.0, 720.0, (6, 50)), rng.uniform(-90.0, 90.0, 50)
    suns = sun_directions(azimuth, elevation)
    assert suns.shape == (6, 50, 3)
    np.testing.assert_allclose(np.linalg.norm(suns, axis=-1), 1.0, rtol=2.0**-50)
    a, e = np.radians(azimuth), np.radians(elevation)
    known = np.stack([np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), np.broadcast_to(np.sin(e), a.shape)], axis=-1)
    np.testing.assert_allclose(suns, known, rtol=0, atol=16 * 2.0**-52)


@cases(
    ("options", "east", "north", "up"),
    [
        ({}, [1, 0, 0], [0, 1, 0], [0, 0, 1]),
        ({"up": "y"}, [1, 0, 0], [0, 0, -1], [0, 1, 0]),
        ({"up": "x"}, [0, 0, -1], [0, 1, 0], [1, 0, 0]),
        ({"up": "y", "north": "x"}, [0, 0, 1], [1, 0, 0], [0, 1, 0]),
        ({"north": [-2, 0, 0]}, [0, 1, 0], [-1, 0, 0], [0, 0, 1]),
        ({"north": [0, 3, 7]}, [1, 0, 0], [0, 1, 0], [0, 0, 1]),  # what goes up of it does not matter
        ({"up": [0, 0, -5], "north": "x"}, [0, 1, 0], [1, 0, 0], [0, 0, -1]),
    ],
)
def test_the_compass_lies_across_up(options: Any, east: Any, north: Any, up: Any) -> None:
    suns = sun_directions([90.0, 0.0, 0.0, 270.0], [0.0, 0.0, 90.0, 0.0], **options)
    assert suns.tolist() == [east, north, up, (-np.array(east, np.float64)).tolist()]
    # East, north and up are right-handed: seen from above, east is to the right of north.
    assert np.linalg.det(suns[:3]) == 1.0


def test_columns_of_tables_go_straight_in_and_suns_that_are_down_count_nothing() -> None:
    """Such as pandas' series, of which NumPy makes an array."""

    class Series:
        def __init__(self, *values: float) -> None:
            self.values = values

        def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
            return np.array(self.values, dtype)

    azimuth, elevation = Series(60.0, 120.0, 180.0, 300.0), Series(-3.0, 30.0, 60.0, 0.0)
    octree = Octree.from_mesh(box((1, -9, 0), (2, 9, 0.5)))
    suns = sun_directions(azimuth, elevation)
    assert sun_hours(octree, [[0.0, 0, 9], [0.9, 0, 0.01]], None, suns, [1.0, 2, 4, 8], up="z").tolist() == [6.0, 4.0]


@cases(
    ("argument", "options", "said"),
    [
        ("azimuth", {"azimuth": [0.0, np.inf]}, "finite numbers, in degrees, got inf in row 1"),
        ("azimuth", {"azimuth": [[0.0], [np.nan]]}, "finite numbers, in degrees, got nan in row 1"),
        ("azimuth", {"azimuth": ["N"]}, "real numbers"),
        ("elevation", {"elevation": [0.0, 90.5]}, "degrees from -90 to 90, got 90.5 in row 1"),
        ("elevation", {"elevation": np.nan}, "degrees from -90 to 90, got nan in row 0"),
        (
            "elevation",
            {"azimuth": [0.0, 1.0], "elevation": [1.0, 2.0, 3.0]},
            r"that of azimuth, \(2,\), got shape \(3,\)",
        ),
        ("north", {"north": "z"}, r"a direction across up, \[0.0, 0.0, 1.0\], got \[0.0, 0.0, 1.0\]"),
        ("north", {"north": [0, 1e-9, 1]}, "a direction across up"),
        ("north", {"north": "n"}, "'x', 'y' or 'z', got 'n'"),
        ("north", {"north": [0, 0, 0]}, "non-zero"),
        ("up", {"up": [0, 0]}, "shape"),
    ],
)
def test_bad_angles_are_named(argument: str, options: Any, said: str) -> None:
    given = {"azimuth": 0.0, "elevation": 0.0, **options}
    with pytest.raises(ValueError, match=rf"^{argument}: expected .*{said}"):
        sun_directions(given.pop("azimuth"), given.pop("elevation"), **given)


PVLIB = """,apparent_zenith,zenith,apparent_elevation,elevation,azimuth,equation_of_time
2026-06-21 09:00:00+02:00,59.9,60.0,30.0,29.9,90.0,-1.9
2026-06-21 13:00:00+02:00,29.9,30.0,60.0,59.9,180.0,-1.9
2026-06-21 23:00:00+02:00,100.0,100.0,-10.0,-10.0,0.0,-1.9
"""
TABLES = {
    "commas": "Azimuth, Elevation, Hours\n90, 30, 2\n180, 60, 0.5\n0, -10, 4\n",
    "spaces": "# a comment\nelevation azimuth hours\n\n30 90 2\n60 180 0.5\n# another\n-10 0 4\n",
    "ladybug": "hours;altitude;azimuth\n2;30;90\n0.5;60;180\n4;-10;0\n",
    "tabs": "\ufeffazimuth\thours\tname\televation\n90\t2\ta day\t30\n180\t0.5\tnoon\t60\n0\t4\tnight\t-10\n",
    "pvlib": PVLIB,
}


@cases("name", TABLES)
def test_a_table_of_angles_is_read_by_the_names_of_its_columns(name: str, tmp_path: Path) -> None:
    path = tmp_path / "suns.csv"
    path.write_text(TABLES[name], encoding="utf-8")
    for up in ("z", "y"):
        suns = suns_of(path, up)  # type: ignore[arg-type]
        known = sun_directions([90.0, 180.0, 0.0], [30.0, 60.0, -10.0], up=up)  # type: ignore[arg-type]
        np.testing.assert_array_equal(suns.directions, known)
        assert suns.hours.tolist() == ([1.0, 1.0, 1.0] if name == "pvlib" else [2.0, 0.5, 4.0]) and suns.have_horizon


@cases(
    ("text", "said"),
    [
        (
            "azimuth,hours\n1,2\n",
            "--suns: expected a column apparent_elevation or elevation or altitude, got azimuth, hours",
        ),
        ("azimuth,elevation\n", "--suns: expected a row for each sun below the names, got none"),
        ("azimuth,elevation\n1,2\n3\n", "--suns: expected elevation in each row, got none in row 1 of "),
        ("azimuth,elevation\n1,x\n", "--suns: expected numbers in the column elevation, got .*suns.csv: could not"),
        ("azimuth,elevation\n1,91\n", "--suns: elevation: expected degrees from -90 to 90, got 91.0 in row 0 of "),
        ("elevation,hours\n1,91\n", "--suns: expected a column azimuth, got elevation, hours in"),
    ],
)
def test_what_is_no_table_of_suns_is_said(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "suns.csv").write_text(text)
    with pytest.raises(ValueError, match=f"^{said}"):
        suns_of(tmp_path / "suns.csv")


def test_angles_say_which_axis_was_taken_for_up_and_rows_of_vectors_do_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_ply(box(), tmp_path / "box.ply")
    for text, line in (("azimuth,elevation\n90,30\n", True), ("1 0 1\n", False)):
        (tmp_path / "suns.csv").write_text(text)
        words = ["study", "sun", tmp_path / "box.ply", "--suns", tmp_path / "suns.csv", "-o", tmp_path / "a.npy"]
        assert main([str(word) for word in words]) == 0
        assert ("z was taken" in capsys.readouterr().err) == line
