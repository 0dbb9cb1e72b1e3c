from dataclasses import replace

import pytest

from lupin_bridge.alarms.board import AlarmBoard, Change, active_first
from lupin_bridge.judge.verdict import Verdict
from tests.support.seen import Alarms, alarm

A, B = alarm("a"), alarm("b", raised_ns=2)


def listening(board: AlarmBoard) -> list[Change]:
    heard: list[Change] = []
    board.subscribe(heard.append)
    return heard


def test_listeners_hear_of_a_change_and_find_it_made() -> None:
    board = Alarms()
    board.show([A], is_past=True)
    numbers: list[int] = []
    board.subscribe(lambda _: numbers.append(board.now.number))
    heard = listening(board)
    cleared = replace(A, cleared_at_ns=A.raised_at_ns + 1)
    assert board.show([cleared, B])
    assert heard == [Change((B, cleared))]
    assert numbers == [board.now.number]
    assert (board.now.alarms, board.now.active) == ((cleared, B), (B,))


def test_the_same_again_is_no_change_and_another_source_is() -> None:
    board = Alarms()
    board.show([A])
    heard, number = listening(board), board.now.number
    assert not board.show([A])
    assert (heard, board.now.number) == ([], number)
    assert board.show([A], "starting")
    assert heard == [Change(())]


def test_who_no_longer_listens_is_not_told_and_one_that_fails_harms_nobody(
    caplog: pytest.LogCaptureFixture,
) -> None:
    board = Alarms()
    gone: list[Change] = []
    end = board.subscribe(gone.append)
    end()
    end()

    def fail(_: Change) -> None:
        raise RuntimeError("no network")

    board.subscribe(fail)
    heard = listening(board)
    board.show([A], "heard")
    assert (len(heard), gone) == (1, [])
    assert "no network" in caplog.text


def test_those_that_are_active_come_before_worse_ones_that_are_over() -> None:
    over, still = alarm(cleared_ns=9), alarm("b", Verdict.STRESSED)
    worst = alarm("c")
    assert sorted([over, still, worst], key=active_first) == [worst, still, over]
