"""How a drop is told."""

from __future__ import annotations

from lupin_twin.core.drops import Drop, Reason


def test_a_drop_is_told_with_its_topic_and_why() -> None:
    assert Drop(Reason.SIZE, "9 bytes").on("/t") == "dropped a message on /t: 9 bytes"
    assert Drop(Reason.POSE, "no", "tag '1'").on("/t") == "dropped tag '1' on /t: no"
