"""Changes of alarms: in order, each with an id, bounded, and none lost without being counted."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
from dataclasses import replace

from lupin_bridge.alarms.ledger import Change
from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.notify.webhook import (
    MAX_WAITING,
    RESENT_NS,
    Deliveries,
    Delivery,
    signed,
)
from tests.support.seen import NOW_NS, S, alarm


def taken(deliveries: Deliveries) -> list[Delivery]:
    """All that wait, each taken."""
    found = []
    while (first := deliveries.first) is not None:
        found.append(first)
        deliveries.over(first, taken=True)
    return found


def put(deliveries: Deliveries, *alarms: Alarm, is_past: bool = False) -> list[tuple[str, str]]:
    deliveries.put(Change(alarms, is_past=is_past), NOW_NS, "robot")
    return [(it.change, it.id) for it in taken(deliveries)]


def test_raised_and_cleared_are_told_in_their_order_each_with_an_id_of_its_own() -> None:
    deliveries = Deliveries()
    a, b = alarm("a", raised_ns=NOW_NS), alarm("b", raised_ns=NOW_NS - S)
    assert put(deliveries, a, b) == [("raised", f"{b.id}.raised"), ("raised", f"{a.id}.raised")]
    cleared = replace(a, cleared_at_ns=NOW_NS + S)
    assert put(deliveries, cleared) == [("cleared", f"{a.id}.cleared.{NOW_NS + S}")]


def test_one_that_turns_critical_is_told_once_and_a_worse_value_alone_is_not() -> None:
    deliveries = Deliveries()
    mild = replace(alarm("a", Verdict.STRESSED), raised_as=Verdict.STRESSED)
    bad = replace(mild, reason=replace(mild.reason, verdict=Verdict.CRITICAL))
    raised, worse = f"{mild.id}.raised", f"{mild.id}.worse.critical"
    assert put(deliveries, mild) == [("raised", raised)]
    assert put(deliveries, *(replace(mild, worst=float(value)) for value in range(99))) == []
    assert put(deliveries, bad) == [("worse", worse)]
    assert put(deliveries, *(replace(bad, worst=float(value)) for value in range(99))) == []
    # After a restart both are told once more; who had the one only learns of the other.
    again = Deliveries()
    assert put(again, bad, is_past=True) == [("raised", raised), ("worse", worse)]
    assert [it for it, _ in put(again, replace(bad, cleared_at_ns=NOW_NS + S))] == ["cleared"]
    # One that was raised as critical never gets worse.
    assert [it for it, _ in put(Deliveries(), replace(bad, raised_as=Verdict.CRITICAL))] == [
        "raised"
    ]


def test_an_alarm_that_goes_on_after_all_is_raised_again_with_another_id() -> None:
    deliveries = Deliveries()
    put(deliveries, alarm("a"))
    put(deliveries, alarm("a", cleared_ns=NOW_NS + S))
    ((change, name),) = put(deliveries, alarm("a"))
    assert change == "raised"
    assert name != f"{alarm('a').id}.raised"


def test_what_was_told_and_never_was_is_withdrawn_and_nothing_else() -> None:
    deliveries = Deliveries()
    put(deliveries, alarm("a"))
    deliveries.put(Change((), (alarm("a"), alarm("b"))), NOW_NS, "robot")
    assert [(it.change, getattr(it.alarm, "tag_id", None)) for it in taken(deliveries)] == [
        ("withdrawn", "a")
    ]


def test_of_the_past_what_is_active_and_the_last_day_is_told_with_the_same_ids() -> None:
    """So that nothing is missed over a restart, and a receiver knows what it has had."""
    before = Deliveries()
    old, active = alarm("old", raised_ns=1, cleared_ns=2), alarm("a", raised_ns=1)
    edge = NOW_NS - RESENT_NS
    just = alarm("just", raised_ns=3, cleared_ns=edge)
    missed = alarm("missed", raised_ns=4, cleared_ns=edge - 1)
    ids = put(before, active)
    assert ids == [("raised", f"{active.id}.raised")]
    after = put(Deliveries(), old, active, just, missed, is_past=True)
    assert after == [*ids, ("cleared", f"{just.id}.cleared.{edge}")]


def test_where_no_time_is_known_the_newest_alarm_says_what_day_it_is() -> None:
    deliveries = Deliveries()
    old, new = alarm("old", raised_ns=1, cleared_ns=2), alarm("new", raised_ns=NOW_NS)
    deliveries.put(Change((old, new), is_past=True), None, "robot")
    assert [getattr(it.alarm, "tag_id", None) for it in taken(deliveries)] == ["new"]


def test_past_the_limit_the_oldest_is_given_up_counted_and_told() -> None:
    deliveries = Deliveries()
    alarms = [alarm(str(number), raised_ns=NOW_NS + number) for number in range(MAX_WAITING + 1)]
    deliveries.put(Change(tuple(alarms[:MAX_WAITING])), NOW_NS, "robot")
    assert (len(deliveries), deliveries.dropped) == (MAX_WAITING, 0)
    deliveries.put(Change(tuple(alarms[MAX_WAITING:])), NOW_NS, "robot")
    assert (len(deliveries), deliveries.dropped) == (MAX_WAITING, 1)
    first = deliveries.first
    assert first is not None
    assert first.alarm is not None
    assert first.alarm.tag_id == "1"
    assert json.loads(first.body(deliveries.lost, "robot"))["lost"] == 1
    deliveries.over(first, taken=True, lost=1)
    assert (deliveries.lost, deliveries.dropped) == (0, 1)


def test_one_that_gave_way_while_it_was_sent_takes_no_other_along() -> None:
    deliveries = Deliveries(max_waiting=1)
    deliveries.put(Change((alarm("a"),)), NOW_NS, "robot")
    being_sent = deliveries.first
    assert being_sent is not None
    deliveries.put(Change((alarm("b", raised_ns=NOW_NS + 1),)), NOW_NS, "robot")
    deliveries.over(being_sent, taken=True)
    assert deliveries.lost == 0
    assert [getattr(it.alarm, "tag_id", None) for it in taken(deliveries)] == ["b"]


def test_what_was_lost_while_one_was_sent_is_told_with_the_next() -> None:
    deliveries = Deliveries(max_waiting=2)
    alarms = [alarm(str(number), raised_ns=NOW_NS + number) for number in range(4)]
    deliveries.put(Change(tuple(alarms[:2])), NOW_NS, "robot")
    being_sent = deliveries.first
    assert being_sent is not None
    deliveries.put(Change(tuple(alarms[2:])), NOW_NS, "robot")
    deliveries.over(being_sent, taken=True, lost=0)
    assert deliveries.lost == 1  # the second; the first was taken


def test_one_that_is_given_up_is_counted() -> None:
    deliveries = Deliveries()
    deliveries.put(Change((alarm("a"),)), NOW_NS, "robot")
    first = deliveries.first
    assert first is not None
    deliveries.over(first, taken=False)
    assert (len(deliveries), deliveries.dropped, deliveries.lost) == (0, 1, 1)


def test_a_body_is_the_alarm_as_the_web_contract_has_it() -> None:
    deliveries = Deliveries()
    deliveries.put(Change((alarm("a/ä"),)), NOW_NS, "robot")
    first = deliveries.first
    assert first is not None
    body = json.loads(first.body(0, "robot"))
    assert (body["id"], body["change"], body["lost"]) == (first.id, "raised", 0)
    assert body["alarm"]["tag_id"] == "a/ä"
    assert body["alarm"]["reason"]["limit"] == 10.0
    assert first.id.isascii()


def test_the_signature_is_that_of_standard_webhooks() -> None:
    headers = signed(b"a secret of 20 chars", "an id", 1_795_270_500, b'{"id":1}')
    mac = hmac.new(b"a secret of 20 chars", b'an id.1795270500.{"id":1}', hashlib.sha256)
    assert headers == {
        "webhook-id": "an id",
        "webhook-timestamp": "1795270500",
        "webhook-signature": "v1," + base64.b64encode(mac.digest()).decode(),
    }


def test_a_change_says_where_it_came_from_when_it_was_heard_or_if_that_is_not_known_now() -> None:
    deliveries = Deliveries()
    deliveries.put(Change((alarm("a"),)), NOW_NS, "robot")
    deliveries.put(Change((alarm("b"),)), NOW_NS, "unknown")
    robot, unknown = taken(deliveries)
    said = [json.loads(it.body(0, "recorded"))["origin"] for it in (robot, unknown)]
    assert said == ["robot", "recorded"]
    assert json.loads(unknown.body(0, "unknown"))["origin"] == "unknown"
