"""The live state, the log's state at that moment, and the state after a restart are the same."""

from pathlib import Path

import pytest

from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.state import NO_FLOWER, Pin
from tests.support.journal import select
from tests.support.memory_life import HERE, NOW, THERE, S, twin
from tests.support.waiting import wait_for


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


def count(path: Path) -> int:
    [(found,)] = select(path, "SELECT count(*) FROM scan WHERE is_copy = 0")
    assert isinstance(found, int)
    return found


def test_new_sensors_extend_the_same_scan(path: Path) -> None:
    with twin(path) as life:
        life.receive(-5, t=20.0)
        life.receive(-5, t=25.0, h=60.0)
        assert life.reading("t") == (20.0, 5.0)
        assert life.reading("h") == (60.0, 5.0)
    with twin(path) as life:
        life.receive(-5, t=25.0)
        assert life.reading("t") == (20.0, 5.0)
    assert select(path, "SELECT readings, stamp_ns FROM scan ORDER BY seq") == [
        ("[20.0]", NOW - 5 * S),
        ("[60.0]", NOW - 5 * S),
    ]


def test_of_two_sources_with_one_stamp_the_later_received_counts_and_repeats_change_nothing(
    path: Path,
) -> None:
    with twin(path) as life:
        for _ in range(3):
            life.receive(-5, source="a", t=20.0)
            life.receive(-5, source="b", t=25.0)
        life.receive(-5, source="a", t=20.0)
        assert life.reading() == (25.0, 5.0)
    with twin(path) as life:
        assert life.reading() == (25.0, 5.0)
        life.receive(-5, source="a", t=20.0)
        assert life.reading() == (25.0, 5.0)
    assert count(path) == 2


def test_a_failed_attempt_makes_nothing_younger(path: Path) -> None:
    with twin(path) as life:
        life.receive(-9, status=2)
        life.receive(-8, status=1)
        assert life.live == life.past()
        assert life.live["7"].last_observed_ns == NOW - 9 * S
        life.receive(-7)
        life.receive(-6, status=2)
        life.receive(-5, flower=NO_FLOWER, status=2)
        assert life.live == life.past()
        assert life.live["7"].last_observed_ns == NOW - 7 * S
        before = life.live
    with twin(path) as life:
        assert life.live == life.past() == before


def test_a_stamp_from_the_future_counts_as_its_first_receipt(path: Path) -> None:
    with twin(path) as life:
        life.receive(60, t=20.0)
        life.at(30, passed_s=30)
        life.receive(60, t=20.0)
        life.at(100, passed_s=70)
        life.receive(60, t=20.0)
        assert life.reading() == (20.0, 100.0)
    with twin(path, 130) as life:
        life.receive(60, t=20.0)
        assert life.reading() == (20.0, 130.0)
    assert select(path, "SELECT stamp_ns, own_stamp_ns FROM scan") == [(NOW, NOW + 60 * S)]


def test_it_stays_known_however_many_attempts_follow(path: Path) -> None:
    with twin(path) as life:
        life.receive(60, t=20.0)
        for second in range(1, 12):  # more than a tag's history has
            life.at(second, passed_s=1)
            life.receive(second, h=float(second))
        life.at(100, passed_s=80)
        life.receive(60, t=20.0)
        assert life.reading("t") == (20.0, 100.0)
        assert count(path) == 12


def runs(path: Path) -> list[tuple[object, ...]]:
    return select(path, "SELECT run, joins FROM run ORDER BY run")


@pytest.mark.parametrize("ahead_s", [1.0, 3600.0, 400 * 86_400.0])
def test_a_wall_clock_that_goes_on_is_one_run_however_far_it_jumps(
    path: Path, ahead_s: float
) -> None:
    with twin(path) as life:
        life.receive(-5, t=20.0)
        life.at(ahead_s, passed_s=1.0)
        assert life.reading() == (20.0, ahead_s + 5)
    with twin(path, 2 * ahead_s) as life:
        assert life.reading() == (20.0, 2 * ahead_s + 5)
    assert runs(path) == [(1, None)]


def test_after_a_step_back_later_writes_count_everywhere(path: Path) -> None:
    with twin(path) as life:
        life.receive(-5, t=1.0)
        life.receive(-5, tag="8", t=3.0, pose=HERE)
        life.at(-40)
        assert life.reading() == (1.0, 0.0)
        life.at(-30, passed_s=10)
        life.receive(-31, t=2.0)
        assert life.reading() == (2.0, 1.0)
        assert life.reading(tag="8") == (3.0, 10.0)
        assert life.live["8"].pose == HERE
        # Before its start the step has no data: the earlier state is used.
        assert life.past(-41) == {}
        life.at(30, passed_s=60)
        assert life.reading() == (2.0, 61.0)
        before = life.live
    with twin(path, 31) as life:
        assert life.live == before
    assert runs(path) == [(1, None), (2, 1)]


def test_a_step_back_while_the_twin_is_off_counts_too(path: Path) -> None:
    with twin(path) as life:
        life.receive(-5, t=1.0)
    with twin(path, -40) as life:
        assert life.reading() == (1.0, 0.0)
        life.at(-30)
        life.receive(-31, t=2.0)
        assert life.reading() == (2.0, 1.0)
    with twin(path, 30) as life:
        assert life.reading() == (2.0, 61.0)
    assert runs(path) == [(1, None), (2, 1)]


def test_repeats_after_a_step_are_still_the_same(path: Path) -> None:
    with twin(path) as life:
        life.receive(-5, t=1.0)
        life.at(-40)
        life.receive(-5, t=1.0)
        life.at(60)
        life.receive(-5, t=1.0)
        assert life.reading() == (1.0, 100.0)
    assert count(path) == 1


def test_a_wall_clock_set_back_by_hours_begins_a_run_with_all_that_is_known(path: Path) -> None:
    with twin(path) as life:
        life.receive(-5, t=1.0, pose=HERE)
        life.receive(-5, tag="8", status=2)
        life.at(-7200)
        assert life.reading() == (1.0, 0.0)
        life.at(-7100)
        life.receive(-7101, t=2.0)
        assert life.reading() == (2.0, 1.0)
        before = life.live
        life.at(-7000)
        assert life.past(-3) == life.past(0), "until the first run ended it has the moment"
    with twin(path, -7000) as life:
        assert life.live == before
        assert life.past(-7150)["7"].readings[0].value == 1.0
    assert runs(path) == [(1, None), (2, None)]


def test_a_jump_ahead_joins_the_run_from_before_the_clock_went_back(path: Path) -> None:
    with twin(path, -100) as life:
        life.at(0, passed_s=100)
        life.receive(-5, t=1.0)
        life.at(-7200)
        life.receive(-7200, t=2.0)
        life.at(10, passed_s=10)
        life.receive(9, t=3.0)
        assert life.reading() == (3.0, 1.0)
        assert life.past(-4)["7"].readings[0].value == 1.0
        assert life.past(5)["7"].readings[0].value == 1.0
        before = life.live
    with twin(path, 20) as life:
        assert life.live == before
    assert runs(path) == [(1, None), (2, None), (3, 1)]


def test_a_step_to_before_the_start_of_its_run_has_the_moment(path: Path) -> None:
    with twin(path, -9000) as life:
        life.at(0, passed_s=9000)
        life.receive(-5, t=1.0)
        life.at(-7200)
        life.receive(-7200, t=2.0)
        life.at(-7240)
        assert life.reading() == (2.0, 0.0)


def test_a_simulation_that_continues_after_a_wall_clock_is_the_run_that_goes_on(path: Path) -> None:
    with twin(path, 10, is_simulated=True) as life:
        life.receive(10, t=1.0)
        life.at(500, passed_s=490)
        life.receive(500, t=1.5)
    with twin(path, 501) as life:
        life.receive(501, t=9.0)
    with twin(path, 700, is_simulated=True) as life:
        assert life.reading() == (1.5, 200.0)
    assert select(path, "SELECT run FROM run WHERE ended_stamp_ns IS NULL") == [(1,)]


def test_a_simulation_that_is_played_again_writes_everything_anew(path: Path) -> None:
    with twin(path, 10, is_simulated=True) as life:
        life.receive(10, t=1.0)
        life.receive(20, t=1.5)
        life.at(3)
        assert life.reading() == (1.5, 0.0)
        life.at(10)
        life.receive(10, t=1.0)
        assert life.reading() == (1.0, 0.0)
    assert runs(path) == [(1, None), (2, None)]


BOOT = -3e8  # a board without a clock of its own starts years ago


def filled(path: Path) -> None:
    with twin(path) as life:
        life.receive(-5, t=1.0, pose=HERE)
        life.receive(-9, tag="8", t=4.0)


def test_a_clock_that_contradicts_the_log_begins_nothing_and_is_reported(path: Path) -> None:
    filled(path)
    before = path.read_bytes()
    with twin(path, BOOT) as life:
        assert life.doubts()
        wait_for(lambda: life.memory.condition.state is JournalState.DOUBTING, "the reported doubt")
        assert "contradicts the journal" in life.memory.condition.detail
        assert life.live["7"].readings[0].value == 1.0
        assert life.live["7"].pose == HERE
        life.at(BOOT + 100, passed_s=100)
        life.receive(BOOT + 99, t=2.0)
        assert life.live["7"].readings[0].value == 2.0
        assert life.memory.condition.waiting == 1
    assert runs(path) == [(1, None)]
    assert count(path) == 2
    assert path.read_bytes() == before


def test_once_it_agrees_the_run_goes_on_and_waiting_writes_have_their_own_times(path: Path) -> None:
    filled(path)
    with twin(path, BOOT) as life:
        life.at(BOOT + 100, passed_s=100)
        life.receive(BOOT + 99, t=2.0)
        life.at(BOOT + 110, passed_s=10)
        life.at(3600, passed_s=1)
        assert not life.doubts()
        assert life.reading() == (2.0, 12.0)
        assert life.reading(tag="8") == (4.0, 3609.0)
        assert life.past(3580)["7"].readings[0].value == 1.0
        before = life.live
    with twin(path, 3600) as life:
        assert life.live == before
    assert runs(path) == [(1, None)]


def test_a_clock_that_does_not_agree_within_ten_minutes_is_accepted(path: Path) -> None:
    filled(path)
    with twin(path, BOOT) as life:
        life.receive(BOOT, t=2.0, tag="9")
        life.at(BOOT + 599, passed_s=599)
        assert life.doubts()
        life.at(BOOT + 600, passed_s=1)
        assert not life.doubts()
        assert life.reading(tag="9") == (2.0, 600.0)
        assert life.live["7"].pose == HERE, "tags do not move"
        assert life.live["7"].readings == (), "how old its readings are is not known"
        assert runs(path) == [(1, None), (2, None)]
        # And then it is corrected.
        life.at(50, passed_s=10)
        life.receive(50, t=3.0)
        assert life.reading(tag="9")[0] == 2.0
        assert life.reading() == (3.0, 0.0)
    assert runs(path) == [(1, None), (2, None), (3, 1)]


def test_a_position_counts_from_the_earliest_stamp_that_had_one(path: Path) -> None:
    with twin(path) as life:
        life.receive(-5, t=1.0, pose=HERE)
        life.receive(-60, t=2.0, pose=THERE)
        assert life.live == life.past()
        assert life.past(-30)["7"].pose == HERE
        assert life.past(-61) == {}
    with twin(path) as life:
        life.receive(-80, t=3.0, pose=THERE)
        life.receive(-70, t=3.5, pose=THERE)
        assert life.past(-75)["7"].pose == HERE
        assert life.memory.apply(Pin("9", THERE), life.now_ns) is None
        assert life.past()["9"].pose == THERE
        assert "9" not in life.past(-1)
    assert select(path, "SELECT tag, stamp_ns, x FROM place ORDER BY seq") == [
        ("7", NOW - 5 * S, 1.0),
        ("7", NOW - 60 * S, 1.0),
        ("7", NOW - 80 * S, 1.0),
        ("9", NOW, 5.0),
    ]
