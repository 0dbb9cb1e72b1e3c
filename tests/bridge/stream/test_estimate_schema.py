"""The types of the estimate: named as the messages are."""

from lupin_msgs.srv import GetEstimate

from lupin_bridge.stream.followers import GetEstimateResponse


def test_the_answer_is_named_as_the_service_s() -> None:
    named = list(GetEstimate.Response.get_fields_and_field_types())
    assert list(GetEstimateResponse.model_fields) == named
