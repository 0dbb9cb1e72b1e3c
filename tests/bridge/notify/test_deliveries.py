"""Changes of alarms: ordered, each with an id, bounded, and every lost one counted."""

from dataclasses import replace

from lupin_bridge.alarms.board import Change
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.notify.webhook import RESENT_NS, AlarmNews
from tests.support.seen import NOW_NS, S, alarm


def put(news: AlarmNews, *alarms: Alarm, is_past: bool = False) -> list[tuple[str, str]]:
    found = news.of(Change(alarms, is_past=is_past), NOW_NS)
    return [(it.change, it.id) for it in found]


def test_an_alarm_that_turns_critical_is_sent_once_and_a_worse_value_alone_is_not() -> None:
    news = AlarmNews()
    mild = replace(alarm("a", Verdict.STRESSED), raised_as=Verdict.STRESSED)
    bad = replace(mild, reason=replace(mild.reason, verdict=Verdict.CRITICAL))
    raised, worse = f"{mild.id}.raised", f"{mild.id}.worse.critical"
    assert put(news, mild) == [("raised", raised)]
    assert put(news, *(replace(mild, worst=float(value)) for value in range(99))) == []
    assert put(news, bad) == [("worse", worse)]
    assert put(news, *(replace(bad, worst=float(value)) for value in range(99))) == []
    # After a restart both are sent once more; a receiver of the first only learns of the second.
    again = AlarmNews()
    assert put(again, bad, is_past=True) == [("raised", raised), ("worse", worse)]
    assert [it for it, _ in put(again, replace(bad, cleared_at_ns=NOW_NS + S))] == ["cleared"]
    # One that was raised as critical never gets worse.
    assert [it for it, _ in put(AlarmNews(), replace(bad, raised_as=Verdict.CRITICAL))] == [
        "raised"
    ]


def test_an_alarm_that_continues_after_all_is_raised_again_with_another_id() -> None:
    news = AlarmNews()
    put(news, alarm("a"))
    put(news, alarm("a", cleared_ns=NOW_NS + S))
    ((change, name),) = put(news, alarm("a"))
    assert change == "raised"
    assert name != f"{alarm('a').id}.raised"


def test_a_sent_alarm_that_turns_out_never_to_have_been_is_withdrawn_and_no_other() -> None:
    news = AlarmNews()
    put(news, alarm("a"))
    found = news.of(Change((), (alarm("a"), alarm("b"))), NOW_NS)
    assert [(it.change, it.alarm.tag_id) for it in found] == [("withdrawn", "a")]


def test_active_alarms_and_those_of_the_last_day_are_sent_again_with_the_same_ids() -> None:
    """So that a restart loses none, and a receiver recognises those it has."""
    before = AlarmNews()
    old, active = alarm("old", raised_ns=1, cleared_ns=2), alarm("a", raised_ns=1)
    edge = NOW_NS - RESENT_NS
    just = alarm("just", raised_ns=3, cleared_ns=edge)
    missed = alarm("missed", raised_ns=4, cleared_ns=edge - 1)
    ids = put(before, active)
    assert ids == [("raised", f"{active.id}.raised")]
    after = put(AlarmNews(), old, active, just, missed, is_past=True)
    assert after == [*ids, ("cleared", f"{just.id}.cleared.{edge}")]


def test_without_a_known_time_the_latest_alarm_sets_the_day() -> None:
    news = AlarmNews()
    old, new = alarm("old", raised_ns=1, cleared_ns=2), alarm("new", raised_ns=NOW_NS)
    found = news.of(Change((old, new), is_past=True), None)
    assert [it.alarm.tag_id for it in found] == ["new"]
