from lupin_twin.core.clock import (
    REPORT_LAG_S,
    STANDS_AFTER_S,
    SUBSCRIBE_AFTER_S,
    ClockWatch,
    StampWatch,
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


def test_by_its_states_alone_a_clock_runs_or_has_stopped_or_was_never_set() -> None:
    def check(stamp: int, now_s: float, known: bool = True) -> ClockState:
        return watch.update(stamp * S, now_s, ages_are_known=known)

    watch = StampWatch()
    assert check(0, 0.0) == "none"
    assert check(0, 10.0, known=False) == "none"
    assert check(5, 11.0) == "running"
    assert check(5, 11.0 + STANDS_AFTER_S - BIT) == "running"
    assert check(5, 11.0 + STANDS_AFTER_S) == "stopped", "nobody said that it is only paused"
    assert check(6, 16.0) == "running"
    assert check(6, 16.1, known=False) == "stopped"


def test_a_twins_report_of_its_clock_is_trusted_while_its_states_agree() -> None:
    def check(
        stamp: int, now_s: float, reported: ClockState | None, known: bool = True
    ) -> ClockState:
        return watch.update(stamp * S, now_s, ages_are_known=known, reported=reported)

    watch = StampWatch()
    assert check(5, 10.0, "paused") == "paused", "who comes late need not wait for three seconds"
    assert check(6, 11.0, "paused") == "running", "the state is newer than what was said"
    assert check(6, 11.0 + STANDS_AFTER_S, "paused") == "paused"
    assert check(6, 11.0 + STANDS_AFTER_S, "stopped") == "stopped"
    late_s = 11.0 + STANDS_AFTER_S + REPORT_LAG_S
    assert check(6, late_s - BIT, "running") == "running", "it was said before it stood so long"
    assert check(6, late_s, "running") == "stopped"
    assert check(6, late_s, "paused", known=False) == "stopped"
    assert check(7, late_s, "doubted", known=False) == "doubted"
    assert check(0, late_s, "paused") == "none"
