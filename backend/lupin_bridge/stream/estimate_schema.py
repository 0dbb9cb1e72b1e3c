"""The web contract of the estimates; see `schema`."""

from __future__ import annotations

from pydantic import Field

from lupin_bridge.stream.schema import Contract, Time


class GetEstimateResponse(Contract):
    """GetEstimate's response. A refusal has `ok` false, the reason, and everything else zero."""

    ok: bool
    error_message: str
    mean: list[float | None] = Field(description="sensor's unit, row-major, row 0 at bbox_min_y")
    sd: list[float | None] = Field(
        description="sensor's unit, as mean; the true value is within 1.645 sd 9 times in 10"
    )
    width: int
    height: int
    origin_x: float
    origin_y: float
    resolution_used: float
    sd_known: float = Field(description="a cell is known only if its sd is below this")
    sample_count: int = Field(description="tags that contribute")
    reading_count: int = Field(description="readings that contribute")


class Graded(Contract):
    """Scans predicted from earlier ones of other tags, and how many were in the 90 % interval."""

    scans: int
    inside: int


class EstimateQuality(Contract):
    """How often a sensor's estimates were right; a day lasts the twin's `day_length_s`."""

    fitted_at: Time | None = Field(
        description="the moment of the report; null: no model can be fitted"
    )
    fit_problem: str = Field(description="why the fit failed; empty: it did not")
    graded_since: Time | None = Field(description="first scan that was compared; null: none")
    day: Graded
    week: Graded
    share_day: float | None = Field(description="inside divided by scans; null: no scans")
    share_week: float | None
    is_trusted: bool | None = Field(
        description="false: a share is below 0.8, so the intervals are too narrow; null: fewer "
        "than 40 scans could be compared with other tags, so nothing is claimed"
    )


class EstimateQualities(Contract):
    """`/api/estimate/quality`: the quality of each sensor's estimates."""

    sensors: dict[str, EstimateQuality]


class ExpectedReading(Contract):
    """A tag's newest reading beside the prediction from all others; sensor's unit."""

    measured: float
    observed_at: Time
    expected: float
    expected_sd: float = Field(description="includes the noise of a reading")
    z: float = Field(description="joint deviation of its latest readings, in sds")
    offset: float = Field(description="deviation of those readings")
    left_out: bool = Field(
        description="the sensor has changed: the estimate leaves out its readings since then"
    )


class ExpectedTags(Contract):
    """`/api/estimate/tags`: the expected reading of each tag with a place, as of a moment."""

    sensor_type: str
    at: Time
    tags: dict[str, ExpectedReading]


class AdvisedPlace(Contract):
    """A place where an additional tag would help; m, map frame."""

    x: float
    y: float
    error_ratio: float = Field(
        description="error with a tag there and at the places before it, divided by that without"
    )


class Advice(Contract):
    """`/api/estimate/advice`: where an additional tag would help most, the best place first."""

    sensor_type: str
    places: list[AdvisedPlace]
