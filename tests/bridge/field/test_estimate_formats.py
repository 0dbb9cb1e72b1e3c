"""An estimate as JSON, NPY and PNG."""

import io
import json
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from PIL import Image

from lupin_bridge import field as formats
from lupin_bridge.field import JSON, NPY, PNG, EstimateQuery, FieldFormat
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.judge.quantities import Ranges, Span
from lupin_bridge.settings import Settings
from lupin_bridge.stream.followers import GetEstimateResponse
from tests.support.estimates import an_estimate

SENSORS = Criteria.of(Settings()).sensors
# Known are the first five of six: sds 0, 0.5, .. below 2.25.
ESTIMATE = an_estimate(width=3, height=2)


def written(field_format: FieldFormat, layer: Literal["mean", "sd"] = "mean") -> bytes:
    return formats.write_estimate(
        ESTIMATE, field_format, EstimateQuery("co2", layer=layer), SENSORS
    )


def test_json_is_the_service_s_response() -> None:
    body = GetEstimateResponse.model_validate(json.loads(written(JSON)))
    assert (body.ok, body.error_message) == (True, "")
    assert body.mean == [20.0, 21.0, 22.0, 23.0, 24.0, 25.0]
    assert body.sd == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]
    assert (body.width, body.height, body.origin_x, body.origin_y) == (3, 2, -1.0, 2.0)
    assert (body.resolution_used, body.sd_known) == (0.5, 2.25)
    assert (body.sample_count, body.reading_count) == (3, 7)


def test_a_large_one_is_written_in_parts_that_are_one_list(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = written(JSON)
    monkeypatch.setattr(formats, "_AT_ONCE", 4)
    assert written(JSON) == whole


def test_a_refusal_has_the_same_names_and_nothing_in_them() -> None:
    body = json.loads(formats.estimate_refusal_json("why"))
    assert GetEstimateResponse.model_validate(body).error_message == "why"
    del body["error_message"]
    assert not any(body.values())


def test_npy_is_mean_and_sd() -> None:
    array = np.load(io.BytesIO(written(NPY)), allow_pickle=False)
    assert (array.shape, array.dtype) == ((2, 2, 3), np.float32)
    np.testing.assert_array_equal(array, (ESTIMATE.grid.mean, ESTIMATE.grid.sd))


@pytest.mark.parametrize(("layer", "highest"), [("mean", 24.0), ("sd", 2.0)])
def test_a_picture_is_transparent_where_it_is_not_known(
    layer: Literal["mean", "sd"], highest: float
) -> None:
    field = formats.estimate_picture(ESTIMATE, layer)
    assert field.value_max == highest
    assert np.isnan(field.values).tolist() == [False] * 5 + [True]
    alpha = np.asarray(Image.open(io.BytesIO(written(PNG, layer))).convert("RGBA"))[..., 3]
    # Its top row is the one of the greatest y.
    assert alpha[0, 2] == alpha[1, 0] == 0
    assert alpha[1, 1] < alpha[1, 2] < alpha[0, 0] < alpha[0, 1]


def test_a_picture_of_nothing_known_is_transparent() -> None:
    field = formats.estimate_picture(an_estimate(2, 2, sd_known=0.0), "mean")
    assert (field.value_min, field.value_max) == (0.0, 0.0)
    assert np.isnan(field.values).all()


def test_headers_say_what_an_array_cannot() -> None:
    assert formats.estimate_metadata(ESTIMATE, SENSORS.named("co2")) == {
        "Sensor": "co2",
        "Unit": "ppm",
        "Width": "3",
        "Height": "2",
        "Origin-X": "-1.0",
        "Origin-Y": "2.0",
        "Resolution": "0.5",
        "Sd-Known": "2.25",
        "Sample-Count": "3",
        "Reading-Count": "7",
    }


def test_known_is_only_what_is_sure_to_a_part_of_the_narrowest_ideal_range() -> None:
    wide, narrow = (Ranges(ideal=Span(20.0, high)) for high in (60.0, 26.0))
    sensor = replace(SENSORS.named("ph"), day=wide, night=narrow)
    found = formats.within_ideal(ESTIMATE, sensor).grid
    assert found.sd_known == 1.0
    assert found.known.ravel().tolist() == [True, True, False, False, False, False]
    for other in (replace(sensor, night=wide), SENSORS.named("ph")):
        assert formats.within_ideal(ESTIMATE, other) is ESTIMATE
