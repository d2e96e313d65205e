"""What users hand over: usual forms of numbers, vectors and files are taken for what they mean, or refused by name."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import (
    Dielectric,
    Mesh,
    MeshError,
    Mirror,
    Octree,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    RenderSettings,
    RepairWarning,
    Scene,
    SceneObject,
    load_mesh,
    load_scene,
    render,
)
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import grid, icosphere

BALL = Octree.from_mesh(icosphere(2))
MANY = np.random.default_rng(1).normal(size=(20, 3))


class TestRays:
    @pytest.mark.parametrize("count", [1, 3, 20])
    def test_one_origin_serves_many_directions(self, count: int) -> None:
        expected = BALL.closest_hit(np.zeros((count, 3)), MANY[:count])
        for origin in ([0, 0, 0], [[0, 0, 0]], (0.0, 0.0, 0.0)):
            np.testing.assert_array_equal(BALL.closest_hit(origin, MANY[:count]).t, expected.t)
            np.testing.assert_array_equal(BALL.any_hit(origin, MANY[:count], leaving=-1), expected.hit)

    @pytest.mark.parametrize("count", [1, 3, 20])
    def test_one_direction_serves_many_origins(self, count: int) -> None:
        expected = BALL.closest_hit(MANY[:count], np.tile([0, 0, -1], (count, 1)))
        for direction in ([0, 0, -1], [[0, 0, -1]]):
            np.testing.assert_array_equal(BALL.closest_hit(MANY[:count], direction).t, expected.t)

    def test_a_single_ray_has_a_single_answer(self) -> None:
        hits = BALL.closest_hit([0, 0, 3], [0, 0, -1])
        assert hits.t.shape == hits.face.shape == hits.u.shape == () and hits.t == 2.0 and hits.hit
        assert hits.points.tolist() == [0.0, 0.0, 1.0] and hits.normals.shape == (3,)
        assert BALL.any_hit([0, 0, 3], [0, 0, -1]).shape == BALL.count_hits([0, 0, 3], [0, 0, -1]).shape == ()

    def test_masked_values_are_refused_and_a_mask_of_none_is_not(self) -> None:
        masked = np.ma.masked_greater(np.abs(MANY), 1.5)
        with pytest.raises(ValueError, match=r"^origins: expected no masked values, got \d+"):
            BALL.closest_hit(masked, MANY)
        free = np.ma.masked_greater(np.abs(MANY), 1e9)
        assert len(BALL.closest_hit(free, MANY).t) == 20

    def test_columns_of_objects_that_are_numbers_are_numbers(self) -> None:
        """As pandas gives its nullable columns: Python numbers, and where one is missing something that is none."""
        np.testing.assert_array_equal(BALL.closest_hit(MANY.astype(object), MANY).t, BALL.closest_hit(MANY, MANY).t)
        broken = MANY.astype(object)
        for missing in (None, "1.0", object()):
            broken[3, 1] = missing
            with pytest.raises(ValueError, match=r"^origins: expected real numbers, got dtype object"):
                BALL.closest_hit(broken, MANY)

    def test_an_integer_beyond_float64_is_named_as_the_reason(self) -> None:
        for name, bad in (("origins", [[0, 0, 10**400]]), ("t_max", 10**400)):
            with pytest.raises(ValueError, match=rf"^{name}: expected numbers that float64 holds, got an integer"):
                BALL.closest_hit(**{"origins": MANY[:1], "directions": MANY[:1], name: bad})


class TestScenes:
    def test_numbers_of_numpy_are_numbers(self) -> None:
        settings = RenderSettings(
            resolution=(np.int64(8), np.int32(6)), samples=np.int16(4), min_weight=np.float32(0.5)
        )
        assert settings == RenderSettings(resolution=(8, 6), samples=4, min_weight=0.5)
        camera = PerspectiveCamera(eye=np.array([0, 0, 4.0]), target=np.zeros(3), fov=np.float64(30))
        assert camera == PerspectiveCamera(eye=(0, 0, 4), target=(0, 0, 0), fov=30)
        assert Phong(diffuse=np.float64(0.5)) == Phong(diffuse=0.5)
        image = render(ball(), resolution=np.array([6, 5]), max_depth=np.int64(1), shadows=np.bool_(False))
        assert image.face.shape == (5, 6)

    def test_kinds_need_not_be_named(self) -> None:
        assert (Dielectric(ior=1.5).type, Mirror().type) == ("dielectric", "mirror")
        assert OrthographicCamera(eye=(0, 0, 1), target=(0, 0, 0), height=2).type == "orthographic"


def ball(normals: Any = None, smooth: bool = True, **material: Any) -> Scene:
    mesh = icosphere(2)
    mesh = Mesh(mesh.vertices, mesh.faces, normals=normals)
    thing = SceneObject(mesh=mesh, material="m", normals="smooth" if smooth else "flat")
    camera = PerspectiveCamera(eye=(0, 0, 4), target=(0, 0, 0), fov=20)
    back = SceneObject(mesh=grid(2, 2), material="m", translate=(0.0, -3.0, 0.0))
    return Scene(
        camera=camera, materials={"m": Phong(**material)}, objects=(thing, back), background=(1, 0, 0), ambient=0.5
    )


class TestNormals:
    def test_zero_normals_stand_for_the_faces(self) -> None:
        """Without a direction a mirror would show what is behind it."""
        zero = ball(np.zeros((162, 3)), diffuse=0.0, ambient=0.0, reflectance=1.0)
        flat = ball(smooth=False, diffuse=0.0, ambient=0.0, reflectance=1.0)
        found, expected = (render(scene, resolution=(30, 30), max_depth=3) for scene in (zero, flat))
        assert expected.face.max() >= 0
        np.testing.assert_array_equal(found.radiance, expected.radiance)
        np.testing.assert_array_equal(found.normal, expected.normal)

    @pytest.mark.judges("Mesh.repaired", "Repairs")
    def test_normals_that_are_not_finite_are_recomputed_by_a_repair(self, tmp_path: Path) -> None:
        mesh = icosphere(2)
        normals = mesh.vertex_normals().copy()
        normals[[3, 7]] = [[np.nan, 0, 0], [0, np.inf, 0]]
        with pytest.raises(MeshError, match=r"normals: .*row 3"):
            Mesh(mesh.vertices, mesh.faces, normals=normals)
        repaired, repairs = Mesh.repaired(mesh.vertices, mesh.faces, normals=normals)
        assert repairs.bad_normals.tolist() == [3, 7] and repairs
        np.testing.assert_array_equal(repaired.normals, mesh.vertex_normals())
        # In a file, too.
        save_ply(Mesh(mesh.vertices, mesh.faces, normals=mesh.vertex_normals()), tmp_path / "a.ply")
        content, body = (tmp_path / "a.ply").read_bytes(), 0
        body = content.index(b"end_header\n") + len(b"end_header\n")
        row = (content.index(b"element face") and len(content) - body - len(mesh.faces) * 13) // len(mesh.vertices)
        at = body + 3 * row + row // 2
        (tmp_path / "b.ply").write_bytes(
            content[:at] + struct.pack("<f" if row == 24 else "<d", np.nan) + content[at + row // 6 :]
        )
        with pytest.warns(RepairWarning, match="1 normals are not finite"):
            assert np.isfinite(load_mesh(tmp_path / "b.ply", repair=True).normals).all()


BOM = b"\xef\xbb\xbf"
PLY = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
PLY += b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
TEXTS = {
    "a.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "a.ply": PLY,
    "a.stl": b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    b"endloop\nendfacet\nendsolid\n",
}


class TestFiles:
    @pytest.mark.parametrize("name", TEXTS)
    def test_a_byte_order_mark_is_passed_over(self, tmp_path: Path, name: str) -> None:
        (tmp_path / name).write_bytes(BOM + TEXTS[name])
        assert load_mesh(tmp_path / name).vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]

    def test_a_byte_order_mark_of_a_scene_is_passed_over(self, tmp_path: Path) -> None:
        text = b"[camera]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\n[materials]\n"
        (tmp_path / "a.toml").write_bytes(BOM + text)
        assert load_scene(tmp_path / "a.toml").camera.eye == (0, 0, 1)


@cases("split", ["kd", "", None, 3, ["sah"]])
def test_a_rule_of_splitting_that_is_none_is_refused_by_name(split: Any) -> None:
    with pytest.raises(ValueError, match=r"^split: expected one of \['midpoint', 'sah'\], got "):
        Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], split=split)
