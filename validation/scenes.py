"""The suite's own scenes and their files."""

from dataclasses import dataclass
from pathlib import Path

SCENES = Path(__file__).resolve().parent.parent / "scenes"


@dataclass(frozen=True)
class Case:
    """A scene file, what it tests, and whether every rung of the ladder adds something to it."""

    name: str
    shows: str
    every_rung: bool = False

    @property
    def path(self) -> Path:
        """The scene file."""
        return SCENES / f"{self.name}.toml"


SCENE_CASES = (
    Case("three_models", "three PLY models on a bounded floor: Phong, shadows, reflections"),
    Case("mirrors", "diffuse objects between mirrors: what a path integrator can judge without any recursion of ours"),
    Case("glass", "dielectrics: refraction, total internal reflection, tinted glass, highlights", every_rung=True),
    Case("checkered", "a diffuse, a mirroring and two glass objects on a checkered floor: what the benchmark renders"),
    Case("stairs", "flat faces under an orthographic camera, hits with known answers"),
)
