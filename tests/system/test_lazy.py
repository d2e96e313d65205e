"""Properties that are computed once: kept, and without a lock that other objects or forked processes wait for."""

import threading

from renderer.lazy import lazy


class Room:
    def __init__(self) -> None:
        self.begun, self.go_on, self.times = threading.Event(), threading.Event(), 0

    @lazy
    def size(self) -> int:
        """Waits until it may go on."""
        self.begun.set()
        assert self.go_on.wait(30)
        self.times += 1
        return self.times


def test_a_value_is_computed_once() -> None:
    room = Room()
    room.go_on.set()
    assert (room.size, room.size, room.times) == (1, 1, 1)
    assert isinstance(Room.size, lazy)


def test_one_object_does_not_wait_for_another() -> None:
    """Python 3.11's own kind has one lock a class: a process forked while it was held hung for ever."""
    slow, quick = Room(), Room()
    thread = threading.Thread(target=lambda: slow.size)
    thread.start()
    assert slow.begun.wait(30)
    quick.go_on.set()
    answers: list[int] = []
    asker = threading.Thread(target=lambda: answers.append(quick.size), daemon=True)
    asker.start()
    asker.join(30)
    slow.go_on.set()
    thread.join(30)
    assert answers == [1]


def test_two_threads_that_compute_at_once_get_the_value_that_is_kept() -> None:
    room = Room()
    answers: list[int] = []
    threads = [threading.Thread(target=lambda: answers.append(room.size)) for _ in range(2)]
    for thread in threads:
        thread.start()
    assert room.begun.wait(30)
    room.go_on.set()
    for thread in threads:
        thread.join(30)
    assert answers == [room.size] * 2
