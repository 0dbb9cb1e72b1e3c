"""The accuracy of estimates, in the form of the contract."""

from __future__ import annotations

import json

from lupin_bridge.stream import pollers
from lupin_bridge.stream.pollers import EstimateQualities
from lupin_twin.estimate.grading import Record, Tally
from lupin_twin.estimate.solution import Place
from lupin_twin.runtime.estimates import Report, TagCheck

S = 1_000_000_000
REPORT = Report(
    5 * S,
    True,
    "why",
    Record(3 * S + 7, Tally(10, 9), Tally(70, 30)),
    (
        TagCheck("a", 20.0, 2 * S, 21.0, 0.5, -2.0, -1.0, None),
        TagCheck("b", 30.0, S, 21.0, 0.5, 9.0, 9.0, S),
    ),
    (Place(1.0, 2.0, 0.75),),
)
BARE = Report(S)


def test_the_hit_rate_of_estimates() -> None:
    body = json.loads(pollers.quality({"co2": REPORT, "ph": BARE}))
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
