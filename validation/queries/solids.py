"""Closed meshes whose inside is known exactly at every whole point, and the points that ask for it."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from validation.meshes import loose
from validation.oracle.star import Star

Floats = NDArray[np.float64]
# Corners are multiples of it, so that 16ths of the way between them are whole.
_STEP = 16
# A point's coordinates about a centre keep to the oracle's bound: 2^16.
_REACH = 2.0**15


@dataclass(frozen=True)
class Part:
    """A star about a centre; turned inside out it is a cavity."""

    star: Star
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turned: bool = False


@dataclass(frozen=True)
class Solid:
    """Some parts as one mesh; with ``soup`` each face has corners of its own."""

    name: str
    parts: tuple[Part, ...]
    soup: bool = False

    def mesh(self, offset: float = 0.0, scale: float = 1.0) -> Mesh:
        """The mesh, moved by whole numbers and times a power of two, which float64 holds exactly."""
        meshes = [
            Mesh(
                (part.star.vertices + part.centre + offset) * scale,
                part.star.faces[:, ::-1] if part.turned else part.star.faces,
            )
            for part in self.parts
        ]
        whole = Mesh.concatenate(meshes)
        return loose(whole.triangles) if self.soup else whole

    def winding(self, points: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Winding numbers (n,) around whole points (n, 3), and which lie on the surface, where they mean nothing."""
        winding, on = np.zeros(len(points), np.int64), np.zeros(len(points), np.bool_)
        for part in self.parts:
            sides = part.star.sides(points - part.centre)
            winding += np.where(sides > 0, -1 if part.turned else 1, 0)
            on |= sides == 0
        return winding, on


def solids() -> list[Solid]:
    """A star alone and as soup, one within another, a cavity, overlapping ones, and two that share their surface."""
    large, small = _star(1, 900.0, 1700.0), _star(2, 200.0, 600.0)
    aside = Part(_star(3, 500.0, 1200.0), (320.0, -160.0, 480.0))
    return [
        Solid("star", (Part(large),)),
        Solid("soup", (Part(large),), soup=True),
        Solid("nested", (Part(large), Part(small))),
        Solid("cavity", (Part(large), Part(small, turned=True))),
        Solid("overlapping", (Part(large), aside)),
        Solid("twice", (Part(large), Part(large))),
    ]


def _star(seed: int, least: float, most: float) -> Star:
    """A ball of 80 faces whose corners are moved in and out to whole places."""
    ball, rng = icosphere(1), np.random.default_rng(seed)
    places = np.round(ball.vertices * rng.uniform(least, most, (len(ball.vertices), 1)))
    return Star(_STEP * places, ball.faces)


def random_points(solid: Solid, rng: Generator, count: int) -> Floats:
    """Whole points anywhere in 1.2 times the box."""
    lower, upper = solid.mesh().bounds
    room = 0.1 * (upper - lower)
    return rng.integers((lower - room).astype(int), (upper + room).astype(int), (count, 3)).astype(np.float64)


def nasty_points(solid: Solid, rng: Generator, count: int) -> Floats:
    """Whole points at corners, on edges and faces, on the lines of edges and in the planes of faces, and one beside."""
    shares = rng.integers(-8, 25, (count, 2))
    kind = rng.integers(0, 6, count)
    shares[kind <= 2] = rng.integers(0, _STEP + 1, (int((kind <= 2).sum()), 2))
    shares[kind == 0] = 0
    shares[(kind == 1) | (kind == 3), 1] = 0
    first, second = np.abs(shares[:, 0]), np.abs(shares[:, 1])
    outside = (kind == 2) & (first + second > _STEP)
    shares[outside] = _STEP - shares[outside]
    a, b, c = solid.mesh().triangles[rng.integers(0, len(solid.mesh().faces), count)].transpose(1, 0, 2)
    points = a + (b - a) / _STEP * shares[:, :1] + (c - a) / _STEP * shares[:, 1:]
    beside = rng.random(count) < 0.4
    points[beside] += rng.integers(-1, 2, (int(beside.sum()), 3))
    return np.clip(points, -_REACH, _REACH)
