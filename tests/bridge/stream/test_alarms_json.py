import json
from dataclasses import replace

from lupin_bridge.alarms.board import board_of
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.verdict import Kind, Reason, Verdict
from lupin_bridge.stream import schema
from lupin_bridge.stream.frames import alarms_message
from lupin_bridge.stream.state_json import MAX_IN_FRAME, alarms_body, alarms_in_frame
from tests.bridge.stream.test_frames import received
from tests.support.seen import NOW_NS, alarm

NIGHT_NS = 1_000_000_000_000
COLD = Alarm(
    id="1f",
    reason=Reason(Kind.RANGE, Verdict.CRITICAL, "temperature", 6.5, 10.0, NIGHT_NS),
    tag_id="7",
    raised_at_ns=NIGHT_NS + 5,
    cleared_at_ns=None,
    worst=6.25,
)


def test_a_frame_matches_its_contract_type_in_all_fields_and_their_order() -> None:
    wire = alarms_message(
        replace(board_of([COLD]), source="journal", since_ns=NIGHT_NS), None, (), 0
    )
    text = received(wire)
    schema.AlarmsFrame.model_validate_json(text, strict=True)
    frame = json.loads(text)
    assert list(frame) == ["type", "notes", "alarms", "source", "since"]
    assert list(frame["alarms"][0].items()) == [
        ("id", "1f"),
        (
            "reason",
            {
                "kind": "range",
                "verdict": "critical",
                "sensor": "temperature",
                "value": 6.5,
                "limit": 10.0,
                "since": {"sec": 1000, "nanosec": 0},
            },
        ),
        ("tag_id", "7"),
        ("raised_at", {"sec": 1000, "nanosec": 5}),
        ("cleared_at", None),
        ("worst", 6.25),
    ]


def test_an_answer_without_alarms_has_its_limit_of_knowledge() -> None:
    body = alarms_body([], "starting", None)
    assert body == {"alarms": [], "source": "starting", "since": None}
    schema.Alarms.model_validate(body)


def test_the_alarms_of_a_frame_are_limited_with_the_active_ones_first() -> None:
    for active in (MAX_IN_FRAME - 1, MAX_IN_FRAME + 1):
        alarms = [alarm(str(number)) for number in range(active)]
        over = [alarm(f"over {number}", cleared_ns=NOW_NS) for number in range(2)]
        found = alarms_in_frame(board_of([*over, *alarms]), NOW_NS)
        assert len(found) == MAX_IN_FRAME
        assert sum(one.is_active for one in found) == min(active, MAX_IN_FRAME)
