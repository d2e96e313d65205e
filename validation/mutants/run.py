"""Runs mutants on all processors, goes on from the last run, and keeps a record."""

import json
import os
import queue
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from renderer.system.files import write_atomically
from validation.mutants.equivalent import EQUIVALENT
from validation.mutants.judge import GROUPS, gates, judge, noticed_by_gates
from validation.mutants.record import Record, digest, judging_files, summary
from validation.mutants.sites import Mutant, chosen, mutants
from validation.mutants.targets import files, record_of
from validation.mutants.touched import Touched, read
from validation.mutants.verdict import Verdict
from validation.mutants.workshop import TOUCHED, Workshop

ROOT = Path(__file__).resolve().parents[2]
# Seconds that the sound renderer may take for all tests, or for one group of checks.
_PATIENCE = 3600.0


def run(target: str, count: int, seed: int, output: Path, step: Callable[[str], None]) -> dict[str, Any]:
    """Judge ``count`` mutants of a target, chosen by ``seed``; those that its record in ``output`` has are not judged
    again, and those that are proved to change no answer not at all.

    The file is written after each, so that a run that is cut off loses nothing. Fewer mutants than in an earlier run
    are the first of that run's, whose others stay in the record. Returns ``record.summary``. Raises ``ValueError``
    where the record is one of another seed, and ``ChildProcessError`` where the sound renderer is not found sound.
    """
    path = record_of(target, output)
    record = Record(path, ROOT)
    if record.seed not in (None, seed):
        raise ValueError(f"--seed: expected {record.seed}, as in {path}, or another --output, got {seed}")
    every = mutants(files(target, ROOT), ROOT)
    # Sources that have shrunk may have fewer than were asked for once.
    some = chosen(every, max(count, min(record.asked, len(every))), seed)
    waiting = [mutant for mutant in some[:count] if record.row(mutant) is None]

    def keep(mutant: Mutant, verdict: Verdict) -> None:
        record.add(mutant, verdict)
        record.write(seed, some)

    record.forget(waiting)
    for mutant in waiting:
        if mutant.key in EQUIVALENT:
            record.add(mutant, Verdict(None, False, None, 0.0))
    waiting = [mutant for mutant in waiting if mutant.key not in EQUIVALENT]
    record.write(seed, some)
    if waiting:
        with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
            workers = min(len(waiting), os.cpu_count() or 1)
            shops = [Workshop(ROOT, _made(Path(folder) / str(number))) for number in range(workers)]
            touched = _touched(shops[0], output / "touched.json", step)
            _judge_all(waiting, shops, touched, keep, step)
    found = summary(path, ROOT)
    assert found is not None  # it was just written
    return found


def _judge_all(
    waiting: Sequence[Mutant],
    shops: Sequence[Workshop],
    touched: Touched,
    keep: Callable[[Mutant, Verdict], None],
    step: Callable[[str], None],
) -> None:
    """Judge mutants, one in each workshop at a time; ``keep`` is called by this thread."""
    with ThreadPoolExecutor(len(shops)) as pool, _stopped(shops):
        sounds = list(pool.map(lambda shop: _sound(shop, step), shops))
        free: queue.SimpleQueue[tuple[Workshop, dict[str, float]]] = queue.SimpleQueue()
        for pair in zip(shops, sounds, strict=True):
            free.put(pair)

        def one(mutant: Mutant) -> tuple[Mutant, Verdict]:
            step(f"mutants: {mutant.key}")
            shop, sound = pair = free.get()
            try:
                return mutant, judge(mutant, shop, touched, sound)
            finally:
                free.put(pair)

        futures = [pool.submit(one, mutant) for mutant in waiting]
        try:
            for future in as_completed(futures):
                keep(*future.result())
        finally:
            for future in futures:
                future.cancel()


@contextmanager
def _stopped(shops: Sequence[Workshop]) -> Iterator[None]:
    """Ends what the workshops run where an exception, Ctrl-C too, ends the work; none is waited for."""
    try:
        yield
    except BaseException:
        for shop in shops:
            shop.stop()
        raise


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def _touched(shop: Workshop, stored: Path, step: Callable[[str], None]) -> Touched:
    """Which tests touch what, measured by a run of all tests unless ``stored`` has it for these sources."""
    sources = digest([*judging_files(ROOT), *(ROOT / "renderer").rglob("*.py")], ROOT)
    # What cannot be read is measured anew.
    with suppress(OSError, ValueError, KeyError, TypeError):
        found = json.loads(stored.read_text(encoding="utf-8"))
        if found["sources"] == sources:
            return dict(found["touched"])
    step("mutants: which tests touch what")
    with tempfile.TemporaryDirectory(prefix="touched-") as folder:
        ended = shop.run(
            ["-m", "pytest", "-p", "validation.mutants.plugin", "-n", str(os.cpu_count() or 1), "--dist", "loadfile"],
            _PATIENCE, **{TOUCHED: folder},
        )  # fmt: skip
        if ended.code != 0:
            raise ChildProcessError(
                f"mutants: expected the sound renderer's tests to pass, got\n{ended.output[-2000:]}"
            )
        touched = read(Path(folder), shop.root)
    text = json.dumps({"sources": sources, "touched": touched})
    write_atomically(stored, lambda file: file.write(text.encode()))
    return touched


def _sound(shop: Workshop, step: Callable[[str], None]) -> dict[str, float]:
    """The seconds of each group of checks with the sound renderer, none of which may be red; its kernels are kept."""
    seconds = {}
    for group in GROUPS:
        step(f"mutants: none, as the control of {group}")
        for _ in range(2):  # the first compiles
            ended = gates(shop, (group,), _PATIENCE)
        if noticed_by_gates(ended, group)[1] is not None:
            raise ChildProcessError(f"mutants: expected no red gate of {group}, got\n{ended.output[-2000:]}")
        seconds[group] = ended.seconds
    shop.run(["-m", "renderer", "compile"], _PATIENCE)
    shop.keep()
    return seconds
