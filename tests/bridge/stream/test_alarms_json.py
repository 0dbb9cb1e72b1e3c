from lupin_bridge.alarms.board import board_of
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.stream import schema
from lupin_bridge.stream.frames import MAX_IN_FRAME, alarms_in_frame
from lupin_bridge.stream.state_json import alarms_body
from tests.support.seen import NOW_NS, alarm


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


def test_the_worst_alarm_is_in_a_frame_however_many_came_later() -> None:
    first = alarm("first", raised_ns=1)
    later = [alarm(str(number), Verdict.STRESSED) for number in range(MAX_IN_FRAME)]
    assert first in alarms_in_frame(board_of([first, *later]), NOW_NS)
