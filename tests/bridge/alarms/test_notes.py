"""What people said, joined to alarms."""

from dataclasses import replace

from lupin_bridge.alarms.board import notes_of_alarms
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.verdict import Kind, Reason, Verdict
from lupin_bridge.stream.state_json import alarm_json
from lupin_twin.core.notes import ACKNOWLEDGE, SHELVE, WITHDRAW, Note

NOW = 10**18
HOUR = 3_600 * 10**9
COLD = Alarm("a", Reason(Kind.RANGE, Verdict.STRESSED, "temperature", 9.0, 12.0), "7", NOW - 1)
SHELF = Note("1", NOW, "anna", SHELVE, "alarm:a", "heater", NOW + HOUR)


def test_who_acknowledged_and_who_shelved_until_when_is_told_and_nothing_else() -> None:
    said = [Note("0", NOW, "bert", ACKNOWLEDGE, "alarm:a"), SHELF]
    found = alarm_json(COLD, notes_of_alarms([COLD], said, NOW).get("a"))
    assert {name: value for name, value in found.items() if "_by" in name} == {
        "acknowledged_by": "bert",
        "shelved_by": "anna",
    }
    assert found["acknowledged_at"] == {"sec": 10**9, "nanosec": 0}
    assert found["shelved_until"] == {"sec": 10**9 + 3_600, "nanosec": 0}
    assert found["shelved_reason"] == "heater"
    assert "acknowledged_by" not in alarm_json(COLD)
    assert notes_of_alarms([COLD], said, None) == {}


def test_a_shelf_ends_in_its_time_by_a_later_word_and_by_withdrawal() -> None:
    assert "a" in notes_of_alarms([COLD], [SHELF], NOW + HOUR - 1)
    assert notes_of_alarms([COLD], [SHELF], NOW + HOUR) == {}
    ended = Note("2", NOW, "bert", SHELVE, "alarm:a")
    assert notes_of_alarms([COLD], [SHELF, ended], NOW) == {}
    assert notes_of_alarms([COLD], [SHELF, Note("2", NOW, "anna", WITHDRAW, "note:1")], NOW) == {}


def test_a_shelf_ends_when_its_alarm_gets_worse_and_one_of_later_holds() -> None:
    bad = replace(COLD.reason, verdict=Verdict.CRITICAL)
    worse = replace(COLD, reason=bad, raised_as=Verdict.STRESSED, worse_at_ns=NOW + 1)
    assert notes_of_alarms([worse], [SHELF], NOW + 1) == {}
    again = replace(SHELF, id="2", made_at_ns=NOW + 2)
    assert "a" in notes_of_alarms([worse], [SHELF, again], NOW + 2)


def test_nobody_has_acknowledged_what_an_alarm_became_later() -> None:
    bad = replace(COLD.reason, verdict=Verdict.CRITICAL)
    worse = replace(COLD, reason=bad, raised_as=Verdict.STRESSED, worse_at_ns=NOW + 1)
    seen = Note("0", NOW, "bert", ACKNOWLEDGE, "alarm:a")
    assert "a" in notes_of_alarms([COLD], [seen], NOW + 1)
    assert notes_of_alarms([worse], [seen], NOW + 1) == {}
    again = replace(seen, id="2", made_at_ns=NOW + 1)
    assert "a" in notes_of_alarms([worse], [seen, again], NOW + 2)


def test_what_comes_back_is_shelved_too_unless_it_is_worse_or_another_thing() -> None:
    again = replace(COLD, id="b")
    worse = replace(again, reason=replace(COLD.reason, verdict=Verdict.CRITICAL))
    warm = replace(again, reason=replace(COLD.reason, value=40.0, limit=30.0))
    elsewhere = replace(again, tag_id="8")
    for alarm, is_shelved in ((again, True), (worse, False), (warm, False), (elsewhere, False)):
        assert ("b" in notes_of_alarms([COLD, alarm], [SHELF], NOW)) is is_shelved, alarm
