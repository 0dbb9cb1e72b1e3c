"""Sessions that were signed out: remembered as long as they would have lasted, and no longer."""

from __future__ import annotations

from lupin_bridge.access.credentials import BrowserSession, Sessions

NOW_S = 1_700_000_000.0


def session(name: str, lasts_s: int = 60) -> BrowserSession:
    return BrowserSession(name, int(NOW_S) + lasts_s)


def test_a_session_has_ended_when_it_was_signed_out_and_no_other_has() -> None:
    sessions = Sessions()
    assert not sessions.has_ended(session("a"))
    sessions.sign_out(session("a"), NOW_S)
    assert sessions.has_ended(session("a"))
    assert not sessions.has_ended(session("b"))


def test_what_it_holds_is_closed_once_and_what_others_hold_is_not() -> None:
    sessions, closed = Sessions(), list[str]()
    with (
        sessions.holds(session("a"), lambda: closed.append("a1")),
        sessions.holds(session("a"), lambda: closed.append("a2")),
        sessions.holds(session("b"), lambda: closed.append("b")),
    ):
        with sessions.holds(session("a"), lambda: closed.append("gone")):
            pass
        sessions.sign_out(session("a"), NOW_S)
        assert sorted(closed) == ["a1", "a2"]
    sessions.sign_out(session("b"), NOW_S)
    assert sorted(closed) == ["a1", "a2"], "it has gone by itself"


def test_no_more_are_remembered_than_the_limit_and_those_that_last_are() -> None:
    sessions = Sessions(max_signed_out=2)
    sessions.sign_out(session("short", 1), NOW_S)
    sessions.sign_out(session("long", 60), NOW_S)
    assert len(sessions) == 2
    sessions.sign_out(session("longer", 70), NOW_S)
    assert len(sessions) == 2
    ended = [name for name in ("short", "long", "longer") if sessions.has_ended(session(name))]
    assert ended == ["long", "longer"]


def test_ended_ones_are_forgotten_first_and_all_of_them() -> None:
    sessions = Sessions(max_signed_out=3)
    for name in ("a", "b", "c"):
        sessions.sign_out(session(name, 10), NOW_S)
    sessions.sign_out(session("d", 100), NOW_S + 10)
    assert len(sessions) == 1
    assert sessions.has_ended(session("d"))
