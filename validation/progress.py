"""Where a run is: a bar on a terminal, a line for each step elsewhere."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from renderer.process.terminal import on_terminal


@contextmanager
def steps(total: int | None = None) -> Iterator[Callable[[str], None]]:
    """Yields a function to be called with the name of each step as it begins, ``total`` times if that is known.

    A terminal shows a bar that fills as steps end, the time elapsed and the name of the step under way.
    """
    from tqdm import tqdm  # here, because --help need not wait for it

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


def _lines(total: int | None) -> Callable[[str], None]:
    """Print each step with its number and the seconds since the first began."""
    began, number = time.perf_counter(), 0

    def step(name: str) -> None:
        nonlocal number
        number += 1
        place = f"{number:{len(str(total))}d}/{total}" if total else f"{number}"
        print(f"[{place}] {time.perf_counter() - began:4.0f} s  {name}", flush=True)

    return step
