"""The types of the past: named as the contract has them, and nothing besides."""

from __future__ import annotations

import pytest
from pydantic import BaseModel, ValidationError

from lupin_bridge.past import schema

NOW = {"sec": 1, "nanosec": 0}


def names(model: type[BaseModel]) -> set[str]:
    return {field.alias or name for name, field in model.model_fields.items()}


def test_a_stretch_is_from_and_to() -> None:
    assert names(schema.Stretch) == {"from", "to"}
    found = schema.Stretch.model_validate({"from": NOW, "to": NOW})
    assert found.from_ == found.to
    with pytest.raises(ValidationError):
        schema.Stretch.model_validate({"from_": NOW, "to": NOW})


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        (
            schema.History,
            {"tag_id", "sensor_type", "unit", "from", "to", "is_bucketed", "bucket_s"}
            | {"readings", "buckets", "gaps", "complete_to", "kept_from"},
        ),
        (schema.Bucket, {"start", "n", "mean", "min", "max"}),
        (
            schema.Timeline,
            {"from", "to", "bucket_s", "reach", "buckets", "silences", "runs"}
            | {"complete_to", "kept_from"},
        ),
        (
            schema.TimelineBucket,
            {"start", "scans", "failures", "looks", "pests_seen", "pests_cleared"},
        ),
        (schema.ClockRun, {"from", "to", "is_simulated"}),
    ],
)
def test_a_type_has_the_contracts_names(model: type[BaseModel], expected: set[str]) -> None:
    assert names(model) == expected
    assert model.model_config.get("extra") == "forbid"
