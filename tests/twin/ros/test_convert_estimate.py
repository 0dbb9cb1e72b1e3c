"""Estimates as messages, and back."""

from array import array

import pytest

from lupin_twin.core.state import NANOSECONDS_PER_SECOND as S
from lupin_twin.estimate.engine import Record, Tally
from lupin_twin.estimate.solution import Place
from lupin_twin.field.engine import FieldRefused
from lupin_twin.ros import convert_services
from lupin_twin.runtime.estimates import DEFAULT_PLACES, Report, ReportRequest, TagCheck

REPORT = Report(
    5 * S,
    4 * S,
    "why",
    Record(3 * S, Tally(10, 9), Tally(70, 60)),
    (
        TagCheck("a", 20.0, 2 * S, 21.0, 0.5, -2.0, -1.0, None),
        TagCheck("b", 30.0, S, 21.0, 0.5, 9.0, 9.0, S),
    ),
    (Place(1.0, 2.0, 0.75),),
)


@pytest.mark.parametrize(
    "report", [REPORT, Report(S, None, "", Record(None, Tally(), Tally()))], ids=["full", "bare"]
)
def test_a_report_comes_back_as_it_was(report: Report) -> None:
    assert convert_services.report_of(convert_services.report_response(report)) == report


def test_a_report_query_comes_back_as_it_was() -> None:
    requested = ReportRequest("co2", 7)
    message = convert_services.report_request_message(requested)
    assert convert_services.report_request_of(message) == requested
    message.max_places = 0
    assert convert_services.report_request_of(message) == ReportRequest("co2", DEFAULT_PLACES)
    message.max_places = 21
    with pytest.raises(FieldRefused, match="max_places is 21, the limits are 1 and 20"):
        convert_services.report_request_of(message)


def test_a_report_with_lists_of_unequal_length_is_refused() -> None:
    response = convert_services.report_response(REPORT)
    response.z = array("d", [1.0])
    with pytest.raises(ValueError, match=r"lists of tags are \[1, 2\] long"):
        convert_services.report_of(response)
    response = convert_services.report_response(REPORT)
    for name in ("place_x", "place_y", "error_ratio"):
        setattr(response, name, array("d", [1.0] * 21))
    with pytest.raises(ValueError, match="20 at most"):
        convert_services.report_of(response)
