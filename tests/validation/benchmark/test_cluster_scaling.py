"""What workers cost: the record is whole, arithmetic and simulation agree, and the page says what they say."""

import json
import statistics
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from validation.benchmark.measures import cluster
from validation.benchmark.scaling import arithmetic, tables
from validation.benchmark.scaling.figures import Figures, figures_of, hops, read
from validation.benchmark.scaling.simulation import simulate

PAGE = Path(__file__).parents[3] / "docs" / "guides" / "cluster.md"
RECORD = read()
MEASURED = figures_of(RECORD)
SECONDS = {name: statistics.median(values) for name, values in RECORD["seconds"].items()}
# A part takes one second, and nothing else takes any time.
BARE = Figures(
    planned=0, joined=0, start=0, send=0, tree=0, part=0, point=1.0 / 128, crowded=1, worker=0, worker_point=0,
    driver=0, driver_point=0, task=0, spread=(1.0,),
)  # fmt: skip
small = st.floats(0.0, 0.05)
FIGURES = st.builds(
    Figures, planned=small.map(lambda x: x / 1e4), joined=small.map(lambda x: x / 1e4), start=small, send=small,
    tree=small, part=small, point=st.floats(1e-5, 1e-3), crowded=st.floats(1.0, 1.5), worker=small,
    worker_point=small.map(lambda x: x / 1e4), driver=st.floats(1e-4, 0.05), driver_point=small.map(lambda x: x / 1e4),
    task=small, spread=st.lists(st.floats(0.5, 2.0), min_size=1, max_size=9).map(
        lambda rows: tuple(row * len(rows) / sum(rows) for row in rows)),
)  # fmt: skip


@pytest.mark.parametrize(
    "points, workers, expected",
    [(128 * 10, 1, 10), (128 * 10, 2, 5), (128 * 10, 3, 4), (64, 5, 0.5), (129, 1, 129 / 128)],
)
def test_what_takes_whole_seconds_by_hand(points, workers, expected):
    assert simulate(BARE, points, workers, 128) == pytest.approx(expected)


def test_a_driver_that_is_slower_than_its_workers_by_hand():
    """Ten parts of 3 s of the driver's time, half on the way out, which the workers cannot make shorter."""
    slow = BARE._replace(driver=3.0)
    assert 30.0 <= simulate(slow, 1280, 1000, 128) <= 30.0 + 1.0
    assert arithmetic.estimate(slow, 1280, 1000, 128).driver == 30.0
    assert arithmetic.fed(BARE._replace(driver=0.125), 128) == 8


def bound(f, points, workers, size):
    """Seconds by which arithmetic and simulation may differ.

    While the first parts are sent and while the last is computed, some workers or the driver wait: for no longer than
    the longest part and its way there and back, and the driver's time for the parts that are then under way, two a
    worker. The measured times, repeated from the first, are off their mean by no more than one round of them. And a
    worker that has computed a part before the next is there waits for it: the arithmetic has this for mean parts and a
    busy driver, but neither the ways of tasks nor that long parts do not make up for the waits after short ones.
    """
    parts = -(-points // size)
    under_way, busy = min(parts, 2 * workers), min(parts, workers)
    rounds = min(parts, len(f.spread)) * (max(f.spread) - min(f.spread)) / busy
    refilled = busy * f.driving(size) + f.task
    waits = statistics.mean(max(0.0, refilled - f.computing(size) * part) for part in f.spread)
    waiting = parts / busy * (waits - max(0.0, busy * f.driving(size) - f.computing(size)))
    known = f.computing(size) * (max(f.spread) + rounds) + 2.0 * f.task + f.driving(size) * (under_way + 1)
    return known + waiting


# Short parts that the driver cannot keep up with, between long ones for which it waits.
UNEVEN = BARE._replace(point=0.0008022393417798315, driver=0.03125, spread=(1.6, 0.4))


@example(UNEVEN, 3457, 1, 64)
@example(UNEVEN, 40_000, 1, 64)
@example(BARE._replace(point=2e-5, task=0.044), 7200, 1, 64)  # of parts that are computed faster than they travel
@given(FIGURES, st.integers(1, 40_000), st.integers(1, 60), st.sampled_from([64, 256, 1024]))
def test_arithmetic_and_simulation_agree(f, points, workers, size):
    size = min(size, points)
    found, expected = simulate(f, points, workers, size), arithmetic.estimate(f, points, workers, size)
    assert abs(found - expected.seconds) <= bound(f, points, workers, size)
    # No schedule is faster than its busiest part; the last part may have a short time.
    parts = -(-points // size)
    assert found >= expected.before + expected.driver + expected.behind - 1e-9
    assert (
        found
        <= expected.before
        + parts * f.computing(size) * max(f.spread)
        + 2 * parts * f.driving(size)
        + parts * 2 * f.task
        + expected.behind
    )


@pytest.mark.parametrize("points", tables.POINTS)
@pytest.mark.parametrize("workers", tables.WORKERS)
def test_they_agree_on_the_page(points, workers):
    size, expected = arithmetic.best(MEASURED, points, workers)
    assert abs(simulate(MEASURED, points, workers, size) - expected.seconds) <= bound(MEASURED, points, workers, size)


@pytest.mark.parametrize("workers", [1, 2])
def test_the_simulation_is_the_measured_run(workers):
    """With the tree to be built, within a tenth: runs that were repeated differ by as much, see the record's ranges."""
    found = simulate(MEASURED, RECORD["points"], workers, RECORD["size"], processors=2)
    assert found == pytest.approx(SECONDS[f"built_{workers}"], rel=0.1)


def test_two_workers_do_nine_tenths_of_two_threads():
    """What the issue asks for, of the medians in the record."""
    assert SECONDS["run_2"] / SECONDS["workers_2"] >= 0.9


def test_the_mesh_goes_to_two_more_from_each_that_has_it():
    assert [hops(k) for k in (1, 2, 3, 4, 9, 10, 27, 1000)] == [2, 3, 3, 4, 4, 5, 5, 9]


def test_more_workers_take_no_longer_but_pay_less():
    rows = [arithmetic.best(MEASURED, 100_000_000, workers)[1].seconds for workers in (1, 10, 100)]
    assert rows == sorted(rows, reverse=True)
    fewer, more = (tables.paying(MEASURED, points) for points in tables.POINTS)
    assert 1 < fewer < more


def test_the_page_has_the_tables_of_the_record():
    page = PAGE.read_text(encoding="utf-8")
    for table in tables.tables(RECORD):
        assert table in page
    assert RECORD["command"] in page and RECORD["date"][:10] in page


def test_a_record_of_a_small_city(tmp_path, capsys):
    path = tmp_path / "record.json"
    assert cluster.main(["--mesh", "city_2000", "--rounds", "1", "-o", str(path)]) == 0
    record = json.loads(path.read_text())
    assert record.keys() == RECORD.keys() and record["seconds"].keys() == RECORD["seconds"].keys()
    assert all(len(values) == 1 and values[0] > 0 for values in record["seconds"].values())
    assert record["points"] > 1900 and record["task"] > 0 and record["rate"] > 0
    assert set(record["parts"]) == set(record["costs"]) - {"one"} == {str(record["size"]), str(record["small"])}
    assert all(of["driver"] > 0 and of["workers"] > 0 for of in record["costs"].values())
    said = capsys.readouterr().out
    assert said.startswith("city_2000: ") and "two workers" in said
