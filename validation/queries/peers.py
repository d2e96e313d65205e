"""The other libraries that answer the same queries: trimesh over embreex, libigl, and Open3D where it is installed."""

from contextlib import suppress
from functools import cache
from importlib import import_module
from typing import Any

from validation.references.igl import Igl
from validation.references.trimesh_queries import TrimeshQueries

TRIMESH, LIBIGL, OPEN3D = "trimesh + embreex", "libigl", "Open3D"


@cache
def peers() -> dict[str, Any]:
    """By name the class of each library's queries, made of vertices and faces."""
    found: dict[str, Any] = {TRIMESH: TrimeshQueries, LIBIGL: Igl}
    with suppress(ImportError):
        found[OPEN3D] = import_module("validation.references.open3d_queries").Open3dQueries
    return found
