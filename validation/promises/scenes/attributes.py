"""Attributes of a scene's hits: places, normals, colours, texture coordinates, values, beside trimesh and Mitsuba."""

from typing import Any

import numpy as np
import trimesh
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere
from renderer.rayscene.scene import RayScene
from validation.merged import Merged
from validation.meshes import hilly
from validation.oracle import exact
from validation.oracle.distance import way_from
from validation.oracle.placing import Body, placed
from validation.promises.row import row
from validation.references.mitsuba.attributes import attributes

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]

_COUNT, _RAYS = 8, 500
# Coordinates up to 16 on faces at least 2^-4 high: places err by 2^-48, and weights by 2^-44; those of trimesh, whose
# products have four factors, by 2^-38. What is wrong differs by 2^-10.
_NEAR = 2.0**-34
# The same in float32, whose roundings are 2^29 times as large; but for rays that graze their faces.
_NEAR_FLOAT32, _LEAST_SINE = 2.0**-9, 0.1
_TRIMESH = "trimesh"
_TRIANGLES: Any = trimesh.triangles


class _World:
    """Bodies that stand turned, sheared and mirrored: two with colours and texture coordinates, and one without."""

    def __init__(self, rng: Generator) -> None:
        meshes = [_coloured(icosphere(1), rng), _coloured(hilly(1), rng), box()]
        bodies = [Body(mesh.vertices, mesh.faces.astype(np.int64), _matrices(rng)) for mesh in meshes]
        scene = RayScene()
        objects = [scene.add(mesh, body.matrices) for mesh, body in zip(meshes, bodies, strict=True)]
        self.scene, self.merged = scene, Merged(scene, bodies)
        self.vertices, self.faces = placed(bodies)
        # Without mirrors, so that corners are in the order of the mesh.
        self.own_faces = placed([body._replace(matrices=np.tile(np.eye(3, 4), (_COUNT, 1, 1))) for body in bodies])[1]
        of_vertices = [rng.normal(size=(len(mesh.vertices), 4)) for mesh in meshes]
        of_faces = [rng.normal(size=len(mesh.faces)) for mesh in meshes]
        self.of_vertices = dict(zip(objects, of_vertices, strict=True)), _all(of_vertices)
        self.of_faces = dict(zip(objects, of_faces, strict=True)), _all(of_faces)
        self.colors, self.texcoords = (
            _all([_or_nan(m.colors, m, 3) for m in meshes]),
            _all([_or_nan(m.texcoords, m, 2) for m in meshes]),
        )
        self.rays = _rays(self.vertices[self.faces], rng)


def check_attributes(rng: Generator) -> list[dict[str, Any]]:
    """Closest hits, all hits and closest points of bodies with and without attributes."""
    world = _World(rng)
    origins, directions = world.rays
    hits = world.scene.closest_hit(*world.rays, t_error=True)
    every = world.scene.all_hits(*world.rays, t_error=True)
    near = world.scene.closest_point(origins)
    nearest = _TRIANGLES.closest_point(world.vertices[world.faces[world.merged.merged(near).face]], origins)
    places = {
        "closest hits": (hits, origins + hits.t[:, None] * directions),
        "all hits": (every, origins[every.ray] + every.t[:, None] * directions[every.ray]),
        "closest points": (near, nearest),
    }
    rows = [
        row(f"a scene's {query} know their {what}", _TRIMESH, kept)
        for query, (found, place) in places.items()
        for what, kept in _judged(world, found, place).items()
    ]
    far = np.abs(near.distance - np.linalg.norm(nearest - origins, axis=1)) <= _NEAR
    rows.append(row("a scene's closest points know their distance", _TRIMESH, far))
    errors = [_bounded(world, hits, np.arange(_RAYS)), _bounded(world, every, every.ray)]
    return [
        *rows,
        row("a scene's t is off by t_error at most", "rational arithmetic", np.concatenate(errors)),
        row("a scene's closest hits have colours and texture coordinates", "Mitsuba", _beside_mitsuba(world, hits)),
    ]


def _bounded(world: _World, found: Any, rays: NDArray[np.int64]) -> Bools:
    """Whether t is within its bound of that of the face, and the bound is small."""
    number, kept = world.merged.merged(found).face, []
    for k in np.flatnonzero(number >= 0).tolist():
        origin, direction = (of[rays[k]] for of in world.rays)
        t = exact.intersect(world.vertices[world.faces[number[k]]], origin, direction)
        kept.append(t is not None and way_from(found.t[k], t) <= found.t_error[k] <= _NEAR)
    return np.array(kept)


def _judged(world: _World, found: Any, place: Floats) -> dict[str, Bools]:
    """Whether each attribute is near to trimesh's at the place; nan without a hit."""
    number = world.merged.merged(found).face
    hit = number >= 0
    face = world.faces[number[hit]]
    corners = world.vertices[face]
    weights = _TRIANGLES.points_to_barycentric(corners, place[hit])

    def near(given: Floats, expected: Floats) -> Bools:
        kept = np.asarray(np.isnan(given.reshape(len(hit), -1)).all(axis=1))
        same = np.abs(given[hit] - expected) <= _NEAR
        kept[hit] = (same | (np.isnan(given[hit]) & np.isnan(expected))).reshape(len(face), -1).all(axis=1)
        return kept

    def between(values: Floats) -> Floats:
        mean: Floats = np.einsum("nk,nkx->nx", weights, values[face])
        return mean

    p0, p1, p2 = world.vertices[world.own_faces[number]].transpose(1, 0, 2)
    u, v = found.u[:, None], found.v[:, None]
    given, of_vertices = world.of_vertices
    given_faces, of_faces = world.of_faces
    return {
        "points": near(found.points, place[hit]),
        "u and v": near((1.0 - u - v) * p0 + u * p1 + v * p2, place[hit]),
        "normals": near(found.normals, _TRIANGLES.normals(corners)[0]),
        "colours": near(found.colors, between(world.colors)),
        "texture coordinates": near(found.texcoords, between(world.texcoords)),
        "values between vertices": near(found.interpolate(given), between(of_vertices)),
        "values of faces": near(found.take(given_faces), of_faces[number[hit]]),
    }


def _beside_mitsuba(world: _World, hits: Any) -> Bools:
    """The hits, at other than grazing angles, that have Mitsuba's attributes, of bodies that have some."""
    known = np.nan_to_num(world.colors), np.nan_to_num(world.texcoords)
    theirs = attributes(world.vertices, world.faces, *known, *world.rays)
    directions = world.rays[1]
    sine = np.abs((hits.normals * directions).sum(axis=1)) / np.linalg.norm(directions, axis=1)
    clear = hits.hit & (sine >= _LEAST_SINE) & ~np.isnan(hits.texcoords[:, 0])
    ours = np.column_stack([hits.t, hits.colors, hits.texcoords])[clear]
    kept: Bools = (np.abs(ours - np.column_stack(theirs)[clear]) <= _NEAR_FLOAT32).all(axis=1)
    return kept


def _coloured(mesh: Mesh, rng: Generator) -> Mesh:
    count = len(mesh.vertices)
    return Mesh(mesh.vertices, mesh.faces, colors=rng.uniform(size=(count, 3)), texcoords=rng.uniform(size=(count, 2)))


def _matrices(rng: Generator) -> Floats:
    """Turned and sheared, every other one mirrored too."""
    linear = np.linalg.qr(rng.normal(size=(_COUNT, 3, 3)))[0] @ (
        np.eye(3) + np.triu(rng.uniform(-0.5, 0.5, (_COUNT, 3, 3)), 1)
    )
    linear[:, 0] *= (np.sign(np.linalg.det(linear)) * (-1.0) ** np.arange(_COUNT))[:, None]
    return np.concatenate([linear, rng.uniform(-8.0, 8.0, (_COUNT, 3, 1))], axis=2)


def _rays(triangles: Floats, rng: Generator) -> tuple[Floats, Floats]:
    """From all around at the faces, but for one in ten, which leads away."""
    corners, origins = triangles[rng.integers(0, len(triangles), _RAYS)], rng.uniform(-12.0, 12.0, (_RAYS, 3))
    directions = np.einsum("nk,nkx->nx", rng.dirichlet([1.0] * 3, _RAYS), corners) - origins
    directions[::10] = 30.0 * np.sign(origins[::10])
    return origins, directions


def _all(values: list[Floats]) -> Floats:
    """Values of each mesh, once for each instance."""
    return np.concatenate([np.tile(rows, (_COUNT, *[1] * (rows.ndim - 1))) for rows in values])


def _or_nan(values: Any, mesh: Mesh, width: int) -> Floats:
    return np.full((len(mesh.vertices), width), np.nan) if values is None else np.asarray(values, np.float64)
