"""One run of the suite: it runs the sections in turn, then writes metrics, page and JUnit file."""

import json
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from renderer.mesh.load import load_mesh
from renderer.scene.scene import load_scene
from renderer.system.files import write_atomically
from renderer.system.threads import available_threads
from validation import environment
from validation.gates import Gate
from validation.job import Job
from validation.processes import Workers
from validation.progress import say, steps
from validation.promises import judges
from validation.report import baseline, junit, page, schema, summary
from validation.scenes import SCENES
from validation.sections import Section, choose
from validation.thresholds import Thresholds, load_thresholds

# In the folder of the pictures: the names of those that a run wrote, which the next run may remove.
_MANIFEST = ".written"


@dataclass(frozen=True)
class Request:
    """The options of a run; ``gate`` is a file of thresholds, or None for the suite's own."""

    command: str
    quick: bool
    only: tuple[str, ...]
    output: Path
    gate: Path | None = None
    scenes: tuple[Path, ...] = ()
    meshes: tuple[Path, ...] = ()
    seed: int = 1


def run(request: Request) -> dict[str, Any]:
    """Run the sections, write the report into ``request.output`` and return the metrics.

    Old files in that folder stay unchanged until all new ones are complete. Raises ``ValueError`` and ``OSError`` for
    invalid user files, before any section runs, and ``ImportError`` where a reference is missing.
    """
    # Look at the folder and read all input before any section runs.
    _check_folder(request.output)
    began, started = time.perf_counter(), datetime.now(UTC)
    thresholds = Thresholds() if request.gate is None else load_thresholds(request.gate)
    _open(request)
    given = {kind for kind, files in (("scene", request.scenes), ("mesh", request.meshes)) if files}
    chosen, left_out = choose(request.only, given)
    stored_baseline = baseline.read(request.output / "baseline.json")

    _make_folder(request.output)
    # Read once more for the report: they may grow meanwhile.
    stored_defects(request.output)

    # Run the sections, with pictures in a temporary folder.
    with TemporaryDirectory(dir=request.output, prefix=".run-") as folder, Workers(_processes()) as workers:
        pictures = Path(folder) / "pictures"
        pictures.mkdir()
        scenes, meshes, seed = request.scenes, request.meshes, request.seed
        job = Job(request.quick, thresholds, pictures, lambda _: None, scenes, meshes, seed, workers, say)
        records, gates = _sections(chosen, job)
        if "promises" in records:
            records["promises"]["names"], found = judges.check_names(gates, left_out)
            gates += found

        # Collect the metrics and write the report.
        metrics = {
            "schema": schema.VERSION,
            "command": request.command,
            "quick": request.quick,
            "own": job.own,
            "started": started.isoformat(timespec="seconds"),
            "thresholds": {"file": request.gate and str(request.gate), "moved": thresholds.moved()},
            "left_out": left_out,
            "environment": environment.describe(),
            **records,
        }
        metrics |= _outcome(records, [gate.record() for gate in gates], request.output)
        metrics["baseline"] = baseline.compare(metrics, stored_baseline)
        metrics["seconds"] = time.perf_counter() - began
        write(metrics, request.output, pictures)
    return metrics


def _processes() -> int:
    """As many as there are processors, up to 4: a task may need some GB."""
    return min(4, available_threads())


def _open(request: Request) -> None:
    """Read every user file first, so that an invalid one is an error at once and not minutes later."""
    if not (request.scenes or request.meshes or SCENES.is_dir()):
        raise ValueError(
            f"expected --scene or --mesh, or the suite's own scenes in {SCENES}, which only a checkout has; got none"
        )
    for scene in request.scenes:
        _ = load_scene(scene).instances
    for mesh in request.meshes:
        load_mesh(mesh)


def _sections(chosen: Sequence[Section], job: Job) -> tuple[dict[str, dict[str, Any]], list[Gate]]:
    """Run the sections with one progress bar for all; each section's references are imported with its module."""
    modules: dict[str, Any] = {section.name: import_module(section.module) for section in chosen}
    records: dict[str, dict[str, Any]] = {}
    gates: list[Gate] = []
    with steps(sum(module.steps(job) for module in modules.values())) as step:
        for name, module in modules.items():
            records[name], found = _section(name, module, replace(job, step=step))
            gates += [replace(gate, section=name) for gate in found]
    return records, gates


def _section(name: str, module: Any, job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Run a section. Its steps and its record are checked here, because later nothing could name it."""
    taken: list[str] = []

    def step(what: str) -> None:
        taken.append(what)
        job.step(what)

    began = time.perf_counter()
    record, gates = module.run(replace(job, step=step))
    record |= {"seconds": time.perf_counter() - began}
    # Of a user's files the report counts for more than its bar.
    if job.own and len(taken) != module.steps(job):
        raise RuntimeError(f"{name}: expected {module.steps(job)} steps, got {len(taken)}")
    try:
        json.dumps(record, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise RuntimeError(f"{name}: its record cannot be stored as JSON: {error}") from error
    return record, gates


def _outcome(records: dict[str, dict[str, Any]], gates: list[dict[str, Any]], output: Path) -> dict[str, Any]:
    """The parts of the metrics that follow from records, gates and the defects stored by an earlier run."""
    defects = stored_defects(output)
    found = {"gates": gates, "verdict": summary.verdict(gates), "matrix": summary.matrix(records, gates)}
    found["facts"] = summary.facts(records, gates, defects)
    return found | ({} if defects is None else {"defects": defects})


def write(metrics: dict[str, Any], output: Path, pictures: Path) -> None:
    """Write metrics, page and JUnit file into ``output``; ``pictures`` replace those of an earlier run there."""
    texts = {
        "metrics.json": schema.text(metrics),
        "index.html": page.page(metrics, pictures).encode(),
        "junit.xml": junit.document(metrics),
    }
    kept = output / "pictures"
    if pictures != kept:
        _replace_pictures(pictures, kept)
    for name, text in texts.items():
        _write(output / name, text)


def _replace_pictures(new: Path, kept: Path) -> None:
    """Move the files of ``new`` to ``kept`` and remove what an earlier run wrote there; files of others stay."""
    kept.mkdir(exist_ok=True)
    manifest = kept / _MANIFEST
    names = {path.relative_to(new).as_posix() for path in new.rglob("*") if path.is_file()}
    before = set(manifest.read_text(encoding="utf-8").splitlines()) if manifest.is_file() else set()
    for name in before - names:
        if ".." not in Path(name).parts and not Path(name).is_absolute():
            (kept / name).unlink(missing_ok=True)
    for name in sorted(names):
        (kept / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.move(new / name, kept / name)
    _write(manifest, "".join(f"{name}\n" for name in sorted(names)).encode())


def _check_folder(output: Path) -> None:
    """Raise ``ValueError`` for a folder whose files a report would replace though no report wrote them."""
    expected = f"--output: expected a new folder or one with a report, got {output} with"
    if output.exists() and not output.is_dir():
        raise ValueError(f"--output: expected a folder, got the file {output}")
    if (output / "index.html").exists() and not (output / "metrics.json").exists():
        raise ValueError(f"{expected} another index.html")
    if (output / "pictures").exists() and not (output / "pictures").is_dir():
        raise ValueError(f"{expected} a file called pictures")


def _make_folder(output: Path) -> None:
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--output: expected a folder that can be made, got {output}: {error.strerror}") from None


def run_defects(request: Request) -> list[Gate]:
    """Inject the seeded defects, store the results as ``defects.json`` and return the gates.

    A run that was interrupted goes on where it was. A report in the same folder is drawn again with these results.
    """
    from validation.defects import run as defects
    from validation.defects.answers import Known

    began, started = time.perf_counter(), datetime.now(UTC)
    sources = environment.sources_sha256()
    _check_folder(request.output)
    _make_folder(request.output)
    known = Known(request.output / "defects-so-far.json", sources)
    chosen = defects.chosen(request.quick)
    with steps(len(chosen) + 1) as step:
        record, gates = defects.run(chosen, step, known=known)
    record |= {
        "sources": sources,
        "quick": request.quick,
        "command": request.command,
        "started": started.isoformat(timespec="seconds"),
        "seconds": time.perf_counter() - began,
    }
    text = json.dumps(record, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    _write(request.output / "defects.json", text.encode())
    known.forget()
    _draw_again(request.output)
    return gates


def _draw_again(output: Path) -> None:
    """Draw the report in ``output`` again with the stored defects, if there is one of this schema."""
    try:
        metrics = schema.read(output / "metrics.json")
    except (ValueError, OSError):
        return
    records = {row["section"]: metrics[row["section"]] for row in metrics["matrix"]}
    write(metrics | _outcome(records, metrics["gates"], output), output, output / "pictures")


def stored_defects(output: Path) -> dict[str, Any] | None:
    """The last ``defects.json``, None without one; its ``changed`` says whether the sources have changed since."""
    try:
        record = json.loads((output / "defects.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except ValueError as error:
        raise ValueError(f"{output / 'defects.json'}: expected JSON, got a syntax error: {error}") from None
    if not isinstance(record, dict) or not {"sources", "caught", "defects", "gates", "control"} <= record.keys():
        raise ValueError(f"{output / 'defects.json'}: expected a record of --defects; remove it or run --defects again")
    return record | {"changed": record["sources"] != environment.sources_sha256()}


def write_baseline(output: Path) -> Path:
    """Make ``baseline.json`` from the ``metrics.json`` beside it; ``baseline.summary`` says what is refused."""
    stored = output / "metrics.json"
    if not stored.exists():
        raise ValueError(f"--write-baseline: expected {stored}, which a whole run writes, got no such file")
    text = baseline.text(schema.read(stored))
    path = output / "baseline.json"
    _write(path, text)
    return path


def _write(path: Path, text: bytes) -> None:
    """Write the whole file; on failure the old one stays."""
    write_atomically(path, lambda file: file.write(text))
