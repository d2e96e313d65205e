"""The contract of the extreme cases: what a case that breaks says."""

import pytest

from validation.stability.cases.case import ExtremeCase, Outcome


def case(error: Exception | None) -> ExtremeCase:
    def run(quick: bool) -> Outcome:
        if error is not None:
            raise error
        return Outcome("as expected", holds=True)

    return ExtremeCase(0, "a test", "as expected", ("rule",), "exact", run)


def test_a_case_that_raises_does_not_hold_and_the_report_goes_on() -> None:
    """Once an error in one case, met under a broken kernel, ended the whole run without a report."""
    record = case(ValueError("a picture of 0 or 1 expected")).record(quick=True)
    assert record["holds"] is False
    assert record["ours"] == "ValueError: a picture of 0 or 1 expected"
    assert case(None).record(quick=True)["holds"] is True


def test_a_missing_reference_is_no_failed_case() -> None:
    with pytest.raises(ImportError):
        case(ImportError("No module named 'embreex'")).record(quick=True)
