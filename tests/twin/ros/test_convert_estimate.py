"""Reports on estimates as messages."""

import pytest
from lupin_msgs.srv import GetEstimateReport

from lupin_twin.core.state import NANOSECONDS_PER_SECOND as S
from lupin_twin.estimate.grading import Record, Tally
from lupin_twin.estimate.solution import Place
from lupin_twin.field.engine import FieldRefused
from lupin_twin.ros import convert_services
from lupin_twin.runtime.estimates import DEFAULT_PLACES, Report, ReportRequest, TagCheck

REPORT = Report(
    5 * S,
    True,
    "why",
    Record(3 * S, Tally(10, 9), Tally(70, 60)),
    (
        TagCheck("a", 20.0, 2 * S, 21.0, 0.5, -2.0, -1.0, None),
        TagCheck("b", 30.0, S, 21.0, 0.5, 9.0, 9.0, S),
    ),
    (Place(1.0, 2.0, 0.75),),
)


def test_a_report_has_its_counts_tags_and_places_in_columns() -> None:
    response = convert_services.report_response(REPORT)
    assert (response.ok, response.at.sec, response.fitted_at.sec) == (True, 5, 5)
    assert (response.fit_problem, response.graded_since.sec) == ("why", 3)
    assert (response.day_scans, response.day_inside) == (10, 9)
    assert (response.week_scans, response.week_inside) == (70, 60)
    assert (response.tag_ids, [*response.measured], [*response.z]) == (
        ["a", "b"],
        [20.0, 30.0],
        [-2.0, 9.0],
    )
    assert [at.sec for at in response.changed_since] == [0, 1]
    assert [*response.left_out] == [False, True]
    assert [*response.error_ratio] == [0.75]
    bare = convert_services.report_response(Report(S))
    assert (bare.fitted_at.sec, bare.graded_since.sec, bare.tag_ids) == (0, 0, [])


def test_a_report_query_without_a_number_of_places_gets_five() -> None:
    message = GetEstimateReport.Request(sensor_type="co2")
    assert convert_services.report_request_of(message) == ReportRequest("co2", DEFAULT_PLACES)
    message.max_places = 7
    assert convert_services.report_request_of(message) == ReportRequest("co2", 7)
    message.max_places = 21
    with pytest.raises(FieldRefused, match="max_places is 21, the limits are 1 and 20"):
        convert_services.report_request_of(message)
