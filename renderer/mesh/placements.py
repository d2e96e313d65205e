"""Placements of the meshes of a glTF document: the matrices of its nodes, of their instances and of joints of skins."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MeshError
from renderer.mesh.accessors import Accessors
from renderer.mesh.mesh import Mesh

Floats = NDArray[np.float64]

_INSTANCING = "EXT_mesh_gpu_instancing"


class Placed(NamedTuple):
    """A mesh of a file, and where it stands: the matrices of its instances, (k, 4, 4), and their names, k or none."""

    mesh: Mesh
    matrices: Floats
    names: tuple[str, ...]


class Nodes:
    """The nodes of a document's scene in the order of its tree."""

    def __init__(self, document: dict[str, Any], accessors: Accessors) -> None:
        self._document, self._accessors = document, accessors
        self._nodes: list[dict[str, Any]] = document.get("nodes") or []
        self._above = self._parents()
        self._world = self._places()
        self._shown = self._reached(self._roots())

    def with_meshes(self) -> Iterator[tuple[int, dict[str, Any]]]:
        """Number and entry of each node of the scene that has a mesh."""
        for number in self._shown:
            if "mesh" in self._nodes[number]:
                yield number, self._nodes[number]

    def matrices(self, number: int) -> list[Floats]:
        """The matrices of the mesh of a node, one for each instance."""
        instances = (self._nodes[number].get("extensions") or {}).get(_INSTANCING)
        if not instances:
            return [self._world[number]]
        return [self._world[number] @ own for own in self._instances(instances["attributes"])]

    def have_joints(self, number: int, attributes: dict[str, int]) -> bool:
        """Whether joints pull the vertices of a primitive of a node, in place of its matrices."""
        return self._nodes[number].get("skin") is not None and "JOINTS_0" in attributes

    def joints(self, number: int, attributes: dict[str, int]) -> Floats:
        """The matrix by which joints pull each of those vertices, (V, 4, 4)."""
        return self._skin(self._document["skins"][self._nodes[number]["skin"]], attributes)

    def _roots(self) -> list[int]:
        scenes = self._document.get("scenes") or []
        chosen = self._document.get("scene", 0)
        if scenes:
            return list(scenes[chosen].get("nodes") or [])
        return self._uppermost()

    def _uppermost(self) -> list[int]:
        return [number for number in range(len(self._nodes)) if number not in self._above]

    def _parents(self) -> dict[int, int]:
        """The node above each one that is below another."""
        above: dict[int, int] = {}
        for number, node in enumerate(self._nodes):
            for child in node.get("children") or []:
                if not isinstance(child, int) or not 0 <= child < len(self._nodes):
                    raise MeshError(f"glTF: node {number}: expected children of {len(self._nodes)} nodes, got {child}")
                if child in above:
                    raise MeshError("glTF: expected each node below at most one other, got one below two")
                above[child] = number
        return above

    def _reached(self, roots: list[int]) -> list[int]:
        """The nodes below ``roots``, each after the one that it is below."""
        found, waiting = [], list(reversed(roots))
        while waiting:
            number = waiting.pop()
            found.append(number)
            waiting += reversed(self._nodes[number].get("children") or [])
        return found

    def _places(self) -> dict[int, Floats]:
        """The matrix of each node to the world."""
        order, above = self._reached(self._uppermost()), self._above
        if len(order) < len(self._nodes):
            raise MeshError("glTF: expected nodes without circles, got one")
        world: dict[int, Floats] = {}
        for number in order:
            own = _own_matrix(self._nodes[number])
            world[number] = world[above[number]] @ own if number in above else own
        return world

    def _instances(self, attributes: dict[str, int]) -> Iterator[Floats]:
        parts = {name.lower(): self._accessors.floats(row) for name, row in attributes.items() if name[:1] != "_"}
        for k in range(min((len(rows) for rows in parts.values()), default=0)):
            yield _composed({name: rows[k].tolist() for name, rows in parts.items()})

    def _skin(self, skin: dict[str, Any], attributes: dict[str, int]) -> Floats:
        """The matrices of vertices that joints pull by their weights."""
        joints = np.array([self._world[joint] for joint in skin["joints"]]).reshape(-1, 4, 4)
        if "inverseBindMatrices" in skin:
            bound = self._accessors.floats(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
            joints = joints @ bound[: len(joints)]
        total: Any = 0.0
        for pair in range(len(attributes)):
            if f"JOINTS_{pair}" not in attributes:
                break
            named = self._accessors.integers(attributes[f"JOINTS_{pair}"])
            weights = self._accessors.floats(attributes[f"WEIGHTS_{pair}"])
            total = total + np.einsum("vk,vkij->vij", weights, joints[named])
        return np.asarray(total)


def _own_matrix(node: dict[str, Any]) -> Floats:
    """The matrix of a node to the one above it."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    return _composed(node)


def _composed(parts: dict[str, Any]) -> Floats:
    """The matrix of a translation, a rotation (a quaternion) and a scale, where they are given."""
    x, y, z, w = parts.get("rotation") or (0.0, 0.0, 0.0, 1.0)
    made = np.eye(4)
    made[:3, :3] = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]) * np.array(parts.get("scale") or (1.0, 1.0, 1.0))  # fmt: skip
    made[:3, 3] = parts.get("translation") or (0.0, 0.0, 0.0)
    return made
