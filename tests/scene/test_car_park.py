"""The example of a car park: what stands where, and what its scanner measures."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from plyfile import PlyData


@pytest.fixture(scope="module")
def example() -> ModuleType:
    path = Path(__file__).parents[2] / "scenes" / "make_car_park.py"
    spec = importlib.util.spec_from_file_location("make_car_park", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_five_hundred_cars_stand_on_the_ground_and_some_drive(example: ModuleType) -> None:
    park = example.car_park()
    fleets = park.fleets.values()
    assert sum(len(fleet.x) for fleet in fleets) == 500 and len(fleets) == 3
    before = [park.scene.transforms(number) for number in park.scene.objects]
    park.move(1.5)
    moved = sum(int((a != park.scene.transforms(k)).any(axis=(1, 2)).sum()) for k, a in enumerate(before))
    assert moved == 3 * sum(int((fleet.speed > 0.0).sum()) for fleet in fleets) > 0
    for fleet in fleets:
        places = park.scene.transforms(fleet.objects[0])[:, :, 3]
        np.testing.assert_allclose(places[:, 2], example.height(*places[:, :2].T), atol=1e-12)


def test_its_scanner_measures_the_ground_and_not_its_own_car(example: ModuleType, tmp_path: Path) -> None:
    park = example.car_park()
    cloud = park.scan(0.0, columns=128, rings=16)
    kinds = np.array(park.kinds)[cloud.objects]
    assert set(kinds) == set(example.COLORS)
    ground = cloud.points[kinds == "ground"]
    # Squares of half a metre leave the curve of the hills by some centimetres.
    np.testing.assert_allclose(ground[:, 2], example.height(*ground[:, :2].T), atol=0.1)
    assert not ((kinds == "saloon") & (cloud.instances == 0)).any()
    assert cloud.returns.max() == 3
    assert example.main([str(tmp_path), "--frames", "1"]) == 0
    points = PlyData.read(tmp_path / "frame_000.ply")["vertex"].data
    assert len(points) > 60_000 and len(np.unique(points[["red", "green", "blue"]])) == len(example.COLORS)
