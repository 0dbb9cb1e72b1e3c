from __future__ import annotations

from lupin_twin.core.drops import RECENT_S, Drop, Reason, Recent, Tally

FRAME = Drop(Reason.FRAME, "its frame is 'odom', expected 'map'")


def test_what_is_dropped_is_counted_by_its_reason() -> None:
    tally = Tally()
    for _ in range(3):
        tally.add("frame", "odom", 0.0)
    tally.add("size", "9 bytes, the limit is 8", 1.0)
    tally.add("lost", "too fast", 2.0, 7)
    tally.add("late_stamp", "late stamps on /t", 2.0, 6)
    counts = tally.value(2.0)
    assert counts.dropped == {"frame": 3, "size": 1, "lost": 7, "late_stamp": 6}
    assert counts.recent[-1] == Recent("late_stamp", "late stamps on /t", 6)


def test_what_is_recent_is_told_with_the_last_of_its_kind_and_forgotten() -> None:
    tally = Tally()
    tally.add("frame", FRAME.on("/a"), 0.0)
    tally.add("frame", FRAME.on("/b"), 100.0)
    said = "dropped a message on /b: its frame is 'odom', expected 'map'"
    assert tally.value(100.0).recent == (Recent("frame", said, 2),)
    assert tally.value(RECENT_S - 0.1).recent == (Recent("frame", said, 2),)
    assert tally.value(RECENT_S).recent == (Recent("frame", said, 1),)
    assert tally.value(RECENT_S + 100.0).recent == ()
    assert tally.value(RECENT_S + 100.0).dropped == {"frame": 2}
