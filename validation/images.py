"""Our pictures against Mitsuba's, scene by scene: AOVs first, then radiance under the same and our own offset rule."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from renderer.camera import OrthographicCamera, PerspectiveCamera
from renderer.image import Image, srgb, write_atomically
from renderer.render import render
from renderer.scene import Scene, load_scene
from validation import gates, mitsuba_camera, mitsuba_path, mitsuba_whitted
from validation.cases import CASES, Case
from validation.compare_images import ImageComparison, compare, fragile_pixels
from validation.gates import Gate

Picture = NDArray[Any]
WHITTED = "Whitted recursion over Mitsuba's scene, BSDFs and rays (scalar_rgb)"
PATH = "Mitsuba's native path integrator (scalar_rgb)"


@dataclass(frozen=True)
class Reference:
    """A picture by somebody else: a short name for files, a name for people, the picture, the seconds it took."""

    key: str
    name: str
    radiance: Picture
    seconds: float


def run(quick: bool, folder: Path, step: Callable[[str], None]) -> tuple[dict[str, object], list[Gate]]:
    """Check every scene; writes PNGs into ``folder`` and returns a record for JSON and the gates."""
    size = 256 if quick else 512
    records = []
    found: list[Gate] = []
    for case in CASES:
        record, passed = _check_scene(case, size, folder, step)
        records.append(record)
        found += passed
    step("images: the main scene, 9 samples a pixel")
    hero = render(load_scene(CASES[0].path), resolution=(960, 540), samples=9)
    write_png(folder / "hero.png", srgb(hero.radiance))
    shown = {"file": "hero.png", "seconds": hero.render_seconds, "rays": int(hero.rays.sum()), "samples": 9}
    return {"size": size, "hero": shown, "scenes": records}, found


def _check_scene(
    case: Case, size: int, folder: Path, step: Callable[[str], None]
) -> tuple[dict[str, object], list[Gate]]:
    scene = load_scene(case.path)
    step(f"images: {case.name}, ours")
    matched = render(scene, resolution=(size, size), samples=1, offset="mitsuba")
    own = render(scene, resolution=(size, size), samples=1)
    fragile = fragile_pixels(
        lambda offset, shift: render(
            _shifted(scene, shift), resolution=(size, size), samples=1, offset=offset
        ).radiance
    )
    step(f"images: {case.name}, AOVs")
    aovs, found = _check_aovs(case, scene, matched)
    shift = mitsuba_camera.largest_distance(scene.camera, size)
    reason = "our primary rays are Mitsuba's; both pictures are made with ours"
    found.append(
        Gate("images", f"{case.name}, camera", "pixels between rays", shift, "at most", gates.CAMERA_PIXELS, reason)
    )
    comparisons = []
    references, left_out = _references(scene, size, case.name, step)
    for reference in references:
        for rule, image in (("matched", matched), ("own", own)):
            step(f"images: {case.name}, {reference.key}, {rule} offset")
            result = compare(image.radiance, reference.radiance, fragile, own.face >= 0)
            files = _write(folder, f"{case.name}-{reference.key}-{rule}", image.radiance, reference.radiance, result)
            comparisons.append(_record(reference, rule, result, files))
            found += _gates(case.name, reference, rule, result)
    record: dict[str, object] = {
        "name": case.name,
        "shows": case.shows,
        "size": size,
        "max_depth": scene.render.max_depth,
        "faces": sum(len(i.mesh.faces) for i in scene.instances),
        "rays": int(own.rays.sum()),
        "ours_seconds": own.render_seconds,
        "build_seconds": own.build_seconds,
        "camera_pixels": shift,
        "aovs": aovs,
        "comparisons": comparisons,
        "left_out": left_out,
    }
    return record, found


def _references(
    scene: Scene, size: int, name: str, step: Callable[[str], None]
) -> tuple[list[Reference], dict[str, str]]:
    """The references that can judge a scene, and why the others cannot."""
    depth = scene.render.max_depth
    step(f"images: {name}, whitted reference")
    began = time.perf_counter()
    radiance = mitsuba_whitted.whitted(scene, size, size, max_depth=depth)
    references = [Reference("whitted", WHITTED, radiance, time.perf_counter() - began)]
    reason = mitsuba_path.can_judge(scene)
    if reason is not None:
        return references, {PATH: reason}
    step(f"images: {name}, path reference")
    began = time.perf_counter()
    radiance = mitsuba_path.path(scene, size, size, max_depth=depth)
    return [*references, Reference("path", PATH, radiance, time.perf_counter() - began)], {}


def _check_aovs(case: Case, scene: Scene, ours: Image) -> tuple[dict[str, float], list[Gate]]:
    """Distance and shading normal at every primary hit: geometry and camera apart from shading."""
    height, width = ours.depth.shape
    theirs = mitsuba_whitted.aovs(scene, width, height)
    hit, other = ours.face >= 0, theirs.instance >= 0
    both = hit & other
    depth_error = np.abs(ours.depth[both] - theirs.depth[both]) / theirs.depth[both]
    normal_error = np.linalg.norm(ours.normal[both] - theirs.shading_normal[both], axis=-1)
    shares = {
        "pixels that only one of us hits": float(np.mean(hit != other)),
        "pixels whose distance is off": float(np.sum(~(depth_error <= gates.AOV_DEPTH)) / hit.size),
        "pixels whose normal is off": float(np.sum(~(normal_error <= gates.AOV_NORMAL)) / hit.size),
    }
    reason = f"relative distance {gates.AOV_DEPTH}, normal {gates.AOV_NORMAL} rad; a float32 ray may flip an edge pixel"
    found = [
        Gate("images", f"{case.name}, AOVs", quantity, share, "at most", gates.AOV_SHARE, reason)
        for quantity, share in shares.items()
    ]
    return shares | {"depth_error_max": float(depth_error.max(initial=0.0))}, found


def _gates(name: str, reference: Reference, rule: str, result: ImageComparison) -> list[Gate]:
    thresholds = gates.MATCHED if rule == "matched" else gates.OWN
    subject = f"{name} against {reference.key}, {rule} offset"
    found = []
    for quantity, threshold in thresholds.items():
        value = getattr(result, quantity)
        bound: Literal["at least", "at most"] = "at least" if quantity.startswith("ssim") else "at most"
        found.append(Gate("images", subject, quantity, value, bound, threshold, gates.REASONS[quantity]))
    if rule == "own":
        reason = "the maximum is judged outside these pixels, so they must stay few"
        found.append(
            Gate("images", subject, "fragile_share", result.fragile_share, "at most", gates.FRAGILE_SHARE, reason)
        )
    return found


def _record(reference: Reference, rule: str, result: ImageComparison, files: dict[str, str]) -> dict[str, object]:
    return {
        "reference": reference.key,
        "reference_name": reference.name,
        "reference_seconds": reference.seconds,
        "offset": rule,
        "ssim": result.ssim,
        "ssim_foreground": result.ssim_foreground,
        "pixel_share": result.pixel_share,
        "mean_error": result.mean_error,
        "max_error": result.max_error,
        "fragile_share": result.fragile_share,
        "files": files,
    }


def _write(folder: Path, stem: str, ours: Picture, reference: Picture, result: ImageComparison) -> dict[str, str]:
    """Ours, the reference and 16 times the difference as PNGs; returns their names in ``folder``."""
    shown = np.repeat(np.clip(16.0 * result.difference, 0.0, 1.0)[..., None], 3, axis=2)
    pictures = {
        "ours": srgb(ours),
        "reference": srgb(reference),
        "difference": (shown * 255.0 + 0.5).astype(np.uint8),
    }
    files = {}
    for kind, pixels in pictures.items():
        files[kind] = f"{stem}-{kind}.png"
        write_png(folder / files[kind], pixels)
    return files


def write_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write 8-bit pixels (h, w, 3), whole or not at all."""
    from PIL import Image as Pillow

    write_atomically(path, lambda file: Pillow.fromarray(pixels).save(file, "png"))


class _ShiftedPerspective(PerspectiveCamera):
    shift: tuple[float, float]

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        return _shift_rows(super().rows(width, height), self.shift)


class _ShiftedOrthographic(OrthographicCamera):
    shift: tuple[float, float]

    def rows(self, width: int, height: int) -> NDArray[np.float64]:
        return _shift_rows(super().rows(width, height), self.shift)


def _shift_rows(rows: NDArray[np.float64], shift: tuple[float, float]) -> NDArray[np.float64]:
    moved = rows.copy()
    moved[0] += shift[0] * rows[1] + shift[1] * rows[2]
    moved[3] += shift[0] * rows[4] + shift[1] * rows[5]
    return moved


def _shifted(scene: Scene, shift: tuple[float, float]) -> Scene:
    """The scene seen through a film moved by ``shift`` pixels."""
    kind = _ShiftedPerspective if isinstance(scene.camera, PerspectiveCamera) else _ShiftedOrthographic
    copy = scene.model_copy(update={"camera": kind(**scene.camera.model_dump(), shift=shift)})
    # The meshes are the same; the copy need not load them again.
    copy.__dict__["instances"] = scene.instances
    return copy
