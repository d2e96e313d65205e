"""Normals that are smooth but for sharp edges."""

import numpy as np
import pytest

from renderer import Mesh, Phong, Scene, SceneObject, shapes


def soup(mesh: Mesh) -> Mesh:
    """The faces of a mesh, none of which shares a vertex, as in an STL file."""
    return Mesh(mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))


def prism(sides: int) -> Mesh:
    """A prism about the z axis with closed ends."""
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    vertices = np.concatenate([np.c_[ring, np.zeros(sides)], np.c_[ring, np.ones(sides)], [[0, 0, 0], [0, 0, 1]]])
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    walls = [np.c_[i, j, j + sides], np.c_[i, j + sides, i + sides]]
    return Mesh(vertices, np.concatenate([*walls, np.c_[j, i, low], np.c_[i + sides, j + sides, high]]))


def corner_normals(mesh: Mesh) -> np.ndarray:
    assert mesh.normals is not None
    return mesh.normals[mesh.faces]


@pytest.mark.judges("Mesh.creased")
@pytest.mark.parametrize("make", [lambda mesh: mesh, soup])
def test_a_prism_is_round_along_its_wall_and_sharp_at_its_ends(make) -> None:
    mesh = make(prism(24))
    normals, corners = corner_normals(mesh.creased(30.0)), mesh.triangles
    radial = corners * (1.0, 1.0, 0.0)
    np.testing.assert_allclose(normals[:48], radial[:48], atol=1e-12)
    np.testing.assert_allclose(normals[48:72], np.broadcast_to([0.0, 0.0, -1.0], (24, 3, 3)), atol=1e-12)
    np.testing.assert_allclose(normals[72:], np.broadcast_to([0.0, 0.0, 1.0], (24, 3, 3)), atol=1e-12)
    # 15 degrees from wall to wall.
    flat = corner_normals(mesh.creased(14.9))
    np.testing.assert_allclose(flat, np.repeat(mesh.face_normals()[:, None], 3, axis=1), atol=1e-12)


@pytest.mark.parametrize("make", [lambda mesh: mesh, soup])
def test_all_angles_smooth_everything(make) -> None:
    ball = shapes.icosphere(2)
    normals = corner_normals(make(ball).creased(180.0))
    np.testing.assert_allclose(normals, ball.vertex_normals()[ball.faces], atol=1e-12)


def test_faces_colours_and_parts_stay() -> None:
    colors = np.linspace(0, 1, 24).reshape(8, 3)
    cube = shapes.box()
    mesh = Mesh.concatenate([Mesh(cube.vertices, cube.faces, colors=colors, name="cube")] * 2)
    sharp = mesh.creased(30.0)
    assert np.array_equal(sharp.triangles, mesh.triangles) and sharp.parts == mesh.parts
    assert sharp.colors is not None and mesh.colors is not None
    assert np.array_equal(sharp.colors[sharp.faces], mesh.colors[mesh.faces])


def test_one_sharp_edge_does_not_part_what_is_smooth_around_it() -> None:
    """A dart: of the edges around its tip one is sharp, and its two faces still share a normal by way of the others."""
    turn = 2 * np.pi * np.arange(12) / 12
    ring = np.c_[np.cos(turn), np.sin(turn), np.where(np.arange(12) == 0, 0.35, 0.0)]
    faces = np.c_[np.full(12, 12), np.arange(12), (np.arange(12) + 1) % 12]
    mesh = Mesh([*ring, (0, 0, 0.05)], faces)
    normals = mesh.face_normals()
    parted = np.degrees(np.arccos(np.clip(np.einsum("nk,nk->n", normals, np.roll(normals, 1, axis=0)), -1, 1)))
    limit = float(np.sort(parted)[-2] + parted.max()) / 2
    assert parted.max() > limit > np.sort(parted)[-2]
    assert (np.unique(mesh.creased(limit).vertices, axis=0, return_counts=True)[1]).max() == 2
    assert len({tuple(n) for n in corner_normals(mesh.creased(limit))[:, 0]}) == 1


@pytest.mark.judges("scene.objects.crease")
def test_an_object_is_creased_where_it_stands_and_keeps_the_normals_of_its_file() -> None:
    """Stretched, a wall that was sharp is not."""
    roof = Mesh([[0, 0, 0], [0, 2, 0], [1, 0, 1], [1, 2, 1], [2, 0, 0], [2, 2, 0]],
                [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]])  # fmt: skip
    own = Mesh(roof.vertices, roof.faces, normals=np.broadcast_to([0.0, 0.0, 1.0], (6, 3)))
    eye = {"eye": (0, 0, 9), "target": (0, 0, 0), "up": (0, 1, 0)}

    def placed(mesh: Mesh, **more: object) -> int:
        thing = SceneObject(mesh=mesh, material="m", normals="smooth", crease=60.0, **more)  # type: ignore[arg-type]
        return len(Scene(camera=eye, materials={"m": Phong()}, objects=[thing]).instances[0].mesh.vertices)

    assert placed(roof) == 8 and placed(roof, scale=(1, 1, 0.5)) == 6 and placed(own) == 6


def test_a_mesh_without_faces_stays_empty() -> None:
    assert Mesh([[0, 0, 0]], np.zeros((0, 3), int)).creased().normals.shape == (0, 3)  # type: ignore[union-attr]


@pytest.mark.parametrize("angle", [-1.0, 181.0, np.nan])
def test_an_angle_out_of_range_is_said(angle: float) -> None:
    with pytest.raises(ValueError, match=r"^crease: expected an angle from 0 to 180 degrees, got"):
        shapes.box().creased(angle)
