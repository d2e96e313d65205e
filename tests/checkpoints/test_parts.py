"""Parts on disk: what is whole is kept, what is not is done again, and another study's folder is refused."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer.checkpoints import parts as module
from renderer.checkpoints.parts import Parts, Plan, digest_of

PLAN = Plan(rows=10, size=4, width=0, dtype="<f8", made_of={"kind": "sky", "options": {"patches": 145}})
ROWS = np.arange(10.0)
# Another value for each field, and for each of what a plan is made of; of as many bytes where that can be.
OTHERS: dict[str, Any] = {
    "rows": 11, "size": 5, "width": 1, "dtype": "<i8", "made_of": PLAN.made_of | {"mesh": "1"},
}  # fmt: skip


def _write(parts: Parts, part: int) -> None:
    begin, end = parts.plan.span(part)
    parts.write(part, ROWS[begin:end])


def test_a_run_goes_on_where_it_was_killed_and_joins_the_parts_in_order(tmp_path: Path) -> None:
    folder, result = tmp_path / "r.npy.parts", tmp_path / "r.npy"
    assert Parts(folder, PLAN).missing() == [0, 1, 2]
    _write(Parts(folder, PLAN), 2)
    _write(Parts(folder, PLAN), 0)
    again = Parts(folder, PLAN)
    assert again.missing() == [1]
    with pytest.raises(OSError, match=r"00000001\.part: expected a whole part of the run, got none"):
        again.join(result)
    assert not result.exists()
    _write(again, 1)
    assert (again.joined() == ROWS).all()
    again.join(result)
    assert (np.load(result) == ROWS).all()
    again.remove()
    assert not folder.exists()


@cases(
    "spoil",
    [
        lambda b: b[:-1],
        lambda b: b"",
        lambda b: bytes([b[0] ^ 1]) + b[1:],
        lambda b: b[:-1] + bytes([b[-1] ^ 1]),
        lambda b: b + b"0",
    ],
)
def test_a_part_that_a_disk_has_spoilt_is_done_again(tmp_path: Path, spoil: object) -> None:
    parts = Parts(tmp_path / "parts", PLAN)
    _write(parts, 1)
    path = tmp_path / "parts" / "00000001.part"
    path.write_bytes(spoil(path.read_bytes()))  # type: ignore[operator]
    assert Parts(tmp_path / "parts", PLAN).missing() == [0, 1, 2]


def test_every_field_of_a_plan_has_another_value() -> None:
    assert OTHERS.keys() == {field.name for field in fields(Plan)}


@cases(
    "other, said",
    [
        *((replace(PLAN, **{name: OTHERS[name]}), name) for name in OTHERS if name != "made_of"),
        (replace(PLAN, made_of={"kind": "sun", "options": {"patches": 145}}), "kind"),
        (replace(PLAN, made_of={"kind": "sky", "options": {"patches": 577}}), "options"),
        (replace(PLAN, made_of=OTHERS["made_of"]), "mesh"),
    ],
)
def test_parts_of_another_study_are_refused_and_kept(tmp_path: Path, other: Plan, said: str) -> None:
    _write(Parts(tmp_path / "parts", PLAN), 0)
    with pytest.raises(ValueError, match=f"whose {said} differ; remove the folder"):
        Parts(tmp_path / "parts", other)
    assert Parts(tmp_path / "parts", PLAN).missing() == [1, 2]


@cases("other", [PLAN, *(replace(PLAN, **{name: value}) for name, value in OTHERS.items())])
def test_parts_that_a_removal_cut_short_left_are_those_of_their_run_alone(tmp_path: Path, other: Plan) -> None:
    """Its manifest went first: a run of another plan took its parts for its own, and its result was wrong."""
    _write(Parts(tmp_path / "parts", PLAN), 0)
    (tmp_path / "parts" / "manifest.json").unlink()
    assert Parts(tmp_path / "parts", other).missing() == list(range(1 if other is PLAN else 0, other.parts))


def test_a_part_is_none_under_another_number(tmp_path: Path) -> None:
    _write(Parts(tmp_path / "parts", PLAN), 0)
    (tmp_path / "parts" / "00000000.part").rename(tmp_path / "parts" / "00000001.part")
    assert Parts(tmp_path / "parts", PLAN).missing() == [0, 1, 2]


@cases("text", ["", "[]", "{", "\x00"])
def test_a_manifest_that_is_none_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(ValueError, match="expected the manifest of a run"):
        Parts(tmp_path, PLAN)


def test_digests_tell_shapes_types_and_bytes_apart() -> None:
    arrays = [np.zeros(4), np.zeros((2, 2)), np.zeros(8, np.float32), np.array([0.0, 0.0, 0.0, -0.0])]
    assert len({digest_of(a) for a in arrays} | {digest_of(arrays[0], arrays[0])}) == 5
    assert digest_of(np.arange(6).reshape(2, 3).T) == digest_of(np.ascontiguousarray(np.arange(6).reshape(2, 3).T))


@cases("width", [0, 3])
@cases("most", [1, 30, 1 << 20])
def test_rows_go_where_an_order_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: int, most: int) -> None:
    """Whatever bytes are written at once: less than a row, some rows, all."""
    monkeypatch.setattr(module, "_MOST_BYTES", most)
    plan = Plan(rows=10, size=4, width=width, dtype="<f8", made_of={})
    order = np.random.default_rng(1).permutation(10)
    values = np.arange(10.0 * max(1, width)).reshape(plan.shape(10))
    parts = Parts(tmp_path / "parts", plan, order)
    for part in range(3):
        assert (parts.rows(part) == order[4 * part : 4 * part + 4]).all()
        parts.write(part, values[parts.rows(part)])
    assert (parts.joined() == values).all() and parts.count(values.max()) == 1
    parts.join(tmp_path / "r.npy")
    assert np.load(tmp_path / "r.npy").tobytes() == values.tobytes()
    (tmp_path / "parts" / "00000002.part").unlink()
    with pytest.raises(OSError, match=r"00000002\.part: expected a whole part of the run"):
        parts.join(tmp_path / "none.npy")
    assert not (tmp_path / "none.npy").exists()
