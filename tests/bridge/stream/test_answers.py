"""Alarms, verdicts and the accuracy of estimates, in the form of the contract."""

import json

from lupin_bridge.alarms.board import board_of
from lupin_bridge.judge.judging import NOTHING_JUDGED, Judge
from lupin_bridge.stream import pollers, schema
from lupin_bridge.stream.pollers import EstimateQualities
from lupin_bridge.stream.state_json import MAX_IN_FRAME, alarms_body, alarms_in_frame, judgement
from lupin_twin.core.state import Snapshot
from lupin_twin.estimate.grading import Record, Tally
from lupin_twin.runtime.estimates import Report
from tests.support.seen import BY_LIGHT, NOW_NS, S, alarm, tag


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


def test_a_value_held_only_by_the_deadband_has_its_limit_and_what_clears_it() -> None:
    """From 18 to 26 °C the deadband is 0.4."""
    judge = Judge(BY_LIGHT)
    for at_ns, value in ((NOW_NS, 17.9), (NOW_NS + S, 18.1)):
        judged = judge.see(Snapshot(at_ns, "map", (tag("a", at_ns, temperature=value),)))
    body = schema.Judgement.model_validate_json(judgement(judged), strict=True)
    (reason,) = body.tags["a"].reasons
    assert (reason.limit, reason.release) == (18.0, 18.4)


def test_a_greenhouse_not_judged_yet_is_reported_too() -> None:
    body = schema.Judgement.model_validate_json(judgement(NOTHING_JUDGED), strict=True)
    assert (body.house.verdict, body.tags) == ("unknown", {})


def test_the_hit_rate_of_estimates() -> None:
    report = Report(5 * S, True, "why", Record(3 * S + 7, Tally(10, 9), Tally(70, 30)))
    body = json.loads(pollers.quality({"co2": report, "ph": Report(S)}))
    EstimateQualities.model_validate(body)
    assert body["sensors"]["co2"] == {
        "fitted_at": {"sec": 5, "nanosec": 0},
        "fit_problem": "why",
        "graded_since": {"sec": 3, "nanosec": 7},
        "day": {"scans": 10, "inside": 9},
        "week": {"scans": 70, "inside": 30},
        "share_day": 0.9,
        "share_week": 30 / 70,
        "is_trusted": False,
    }
    bare = body["sensors"]["ph"]
    assert (bare["fitted_at"], bare["graded_since"], bare["share_day"]) == (None, None, None)
    assert bare["is_trusted"] is None
