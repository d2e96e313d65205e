"""Progress of a run: a bar on a terminal, a line for each step elsewhere."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from renderer.system.terminal import on_terminal


@contextmanager
def steps(total: int | None = None) -> Iterator[Callable[[str], None]]:
    """Yields a function to be called with the name of each step as it begins, ``total`` times where that is known.

    On a terminal a bar fills as steps end, with the elapsed time and the name of the current step.
    """
    from tqdm import tqdm  # imported here, so that --help does not wait for it

    if on_terminal():
        shape = "{bar:24} {n}/{total}  {elapsed}  {desc}" if total else "{n} steps, {elapsed}  {desc}"
        bar = tqdm(total=total, bar_format=shape)
        begun = False

        def step(name: str) -> None:
            nonlocal begun
            if begun:
                bar.update()
            begun = True
            bar.set_description_str(name)

        try:
            yield step
            bar.update(int(begun))
        finally:
            bar.close()
    else:
        yield _lines(total)


def say(line: str) -> None:
    """Print a line, above the bar where there is one."""
    from tqdm import tqdm  # as above

    if on_terminal():
        tqdm.write(line)
    else:
        print(line, flush=True)


def _lines(total: int | None) -> Callable[[str], None]:
    """A function that prints each step with its number and the seconds since the start."""
    began, number = time.perf_counter(), 0

    def step(name: str) -> None:
        nonlocal number
        number += 1
        place = f"{number:{len(str(total))}d}/{total}" if total else f"{number}"
        print(f"[{place}] {time.perf_counter() - began:4.0f} s  {name}", flush=True)

    return step
