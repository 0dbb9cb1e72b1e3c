"""Up to when an answer is complete, and since when there are data."""

from dataclasses import replace

import pytest

from lupin_bridge.past import bodies
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition, JournalState

NS = 10**9
# Two runs; a part of the first one was deleted.
JOURNAL = Condition(
    JournalState.RECORDING,
    complete_ns=100 * NS,
    kept_ns=((10 * NS, 40 * NS), (60 * NS, 1_000 * NS)),
)


@pytest.mark.parametrize(
    ("at_s", "complete_s", "kept_s"),
    [(5, 5, 10), (10, 10, 10), (39, 39, 10), (40, 40, 60), (100, 100, 60), (150, 100, 60)],
)
def test_a_moment_has_a_start_of_the_data_and_a_limit_of_completeness(
    at_s: int, complete_s: int, kept_s: int
) -> None:
    assert bodies.moment_headers(JOURNAL, at_s * NS) == {
        "X-Complete-To": f"{complete_s}.000000000",
        "X-Kept-From": f"{kept_s}.000000000",
    }


@pytest.mark.parametrize(
    ("period", "expected"),
    [
        ((20, 30), (30, 20)),
        ((0, 30), (30, 10)),
        ((0, 10), (10, 10)),
        ((20, 70), (70, 60)),
        ((20, 50), (50, 50)),
        ((70, 170), (100, 70)),
        ((150, 170), (150, 150)),
        ((70, 70), (70, 70)),
    ],
)
def test_for_a_period_both_lie_within_it(
    period: tuple[int, int], expected: tuple[int, int]
) -> None:
    start_ns, end_ns = (at_s * NS for at_s in period)
    until_ns, since_ns = (at_s * NS for at_s in expected)
    assert bodies.of_period(JOURNAL, start_ns, end_ns) == (until_ns, since_ns)


def test_unknown_limits_are_omitted() -> None:
    assert bodies.moment_headers(UNKNOWN_JOURNAL, NS) == {}
    assert bodies.period_headers(UNKNOWN_JOURNAL, 0, NS) == {}
    assert bodies.period_fields(UNKNOWN_JOURNAL, 0, NS) == {"complete_to": None, "kept_from": None}
    assert bodies.why_not(UNKNOWN_JOURNAL, NS) == ""


def test_a_journal_without_a_guarantee_guarantees_completeness_from_now_on() -> None:
    assert bodies.kept_from(replace(JOURNAL, kept_ns=()), 5 * NS) == 100 * NS


def test_the_reasons_for_missing_data_are_explained_in_words() -> None:
    assert bodies.why_not(JOURNAL, 50 * NS) == (
        "; what was received before 60.000000000 s is not kept"
    )
    assert bodies.why_not(JOURNAL, 101 * NS) == (
        "; the journal is complete only up to 100.000000000 s"
    )
    assert bodies.why_not(JOURNAL, 70 * NS) == ""
