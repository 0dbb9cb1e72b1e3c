import pytest

from lupin_twin.core.clock import (
    STANDS_AFTER_S,
    SUBSCRIBE_AFTER_S,
    ClockWatch,
    reported_clock,
)
from lupin_twin.core.state import ClockState

S = 1_000_000_000
BIT = 1e-6


def check(watch: ClockWatch, ros_s: float, now_s: float) -> ClockState:
    return watch.update(int(ros_s * S), now_s, is_simulated=True)


def test_a_clock_that_stands_but_is_still_published_is_paused() -> None:
    watch = ClockWatch()
    check(watch, 5, 10.0)
    check(watch, 5, 12.0)
    watch.add_message(12.5)
    assert check(watch, 5, 13.0) == "paused"
    assert check(watch, 5, 12.5 + STANDS_AFTER_S - BIT) == "paused"
    assert check(watch, 5, 12.5 + STANDS_AFTER_S) == "stopped"
    watch.add_message(16.0)
    assert check(watch, 5, 16.5) == "paused"
    assert check(watch, 5.1, 17.0) == "running"


def test_it_subscribes_only_while_the_clock_stands() -> None:
    watch = ClockWatch()
    check(watch, 5, 10.0)
    wants = [watch.should_subscribe]
    for ros_s, now_s in (
        (5, 10.0 + SUBSCRIBE_AFTER_S - BIT),
        (5, 10.0 + SUBSCRIBE_AFTER_S),
        (6, 12.0),
    ):
        check(watch, ros_s, now_s)
        wants.append(watch.should_subscribe)
    assert wants == [False, False, True, False]


def test_a_clock_that_goes_back_runs() -> None:
    watch = ClockWatch()
    check(watch, 500, 10.0)
    assert check(watch, 500, 14.0) == "stopped"
    assert check(watch, 1, 14.5) == "running"


@pytest.mark.parametrize(
    ("reported", "stamp_ns", "ages_are_known", "state"),
    [
        (None, 5, True, "running"),
        (None, 5, False, "stopped"),
        ("paused", 5, True, "paused"),
        ("stopped", 5, True, "stopped"),  # without a tag there is no age
        ("running", 5, False, "stopped"),
        ("doubted", 5, False, "doubted"),
        ("paused", 0, True, "none"),
    ],
)
def test_a_twins_report_of_its_clock_is_trusted_while_its_ages_agree(
    reported: ClockState | None, stamp_ns: int, ages_are_known: bool, state: ClockState
) -> None:
    assert reported_clock(reported, stamp_ns, ages_are_known=ages_are_known) == state
