"""The estimate over HTTP, compared with the ROS service of the same twin."""

import io
import time
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from lupin_msgs.srv import GetEstimate
from PIL import Image

from lupin_bridge.stream.pollers import GetEstimateResponse
from tests.support.messages import scan
from tests.support.processes import limits
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge

PLACES = {"a": (0.25, 0.25), "b": (1.75, 2.75), "c": (0.5, 2.0)}
BOX = {"bbox_min_x": 0.0, "bbox_min_y": 0.0, "bbox_max_x": 2.0, "bbox_max_y": 3.0}
QUERY: dict[str, Any] = {"sensor_type": "temperature", "resolution": 0.5, **BOX}


@cache
def now_s() -> int:
    """The time of the first test here: test files are imported long before the last one runs."""
    return int(time.time())


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    """A bridge whose twin has six hours of readings from three tags."""
    with bridge(*limits(answers_per_s=10_000)) as running:
        for hour in range(6, 0, -1):
            for number, (tag_id, at) in enumerate(PLACES.items()):
                stamp_s = now_s() - 3600 * hour + 60 * number
                readings = {"temperature": 20.0 + 3.0 * at[0] + 0.1 * hour}
                running.peer.observe(scan(tag_id, readings, stamp_s=stamp_s, at=at))
        running.peer.observe(scan("last", {"co2": 1.0}))
        running.tag("last")
        yield running


def test_the_service_and_the_formats_give_the_same_numbers(live: Bridge) -> None:
    # Without the last three, which came later.
    at: dict[str, Any] = {"at": now_s() - 5400}

    def all_until_then() -> Any:
        moment = Time(sec=at["at"])
        service = live.peer.call(GetEstimate, "/twin/get_estimate", **QUERY, at=moment)
        return service if service.reading_count == 15 else None

    service = wait_for(all_until_then, "all of before in the log")
    body = live.get("/api/estimate.json", **QUERY, **at).json()
    npy = live.get("/api/estimate.npy", **QUERY, **at)
    GetEstimateResponse.model_validate(body)
    assert service.ok, service.error_message
    # The bridge knows the width of the ideal range, and the twin does not.
    sd_known = body.pop("sd_known")
    assert 0.0 < sd_known < service.sd_known
    for name, value in body.items():
        reported = getattr(service, name)
        if isinstance(value, list):
            np.testing.assert_array_equal(
                np.array(value, np.float32), np.array(reported, np.float32)
            )
        else:
            assert (np.float32(value) if isinstance(value, float) else value) == reported, name
    assert (body["sample_count"], body["reading_count"]) == (3, 15)
    array = np.load(io.BytesIO(npy.content), allow_pickle=False)
    assert array.shape == (2, 6, 4)
    np.testing.assert_array_equal(array.reshape(2, -1), np.array([service.mean, service.sd]))
    counts = [npy.headers[f"x-estimate-{name}-count"] for name in ("sample", "reading")]
    assert counts == ["3", "15"]
    assert np.float32(npy.headers["x-estimate-sd-known"]) == np.float32(sd_known)
    assert (npy.headers["x-estimate-origin-x"], npy.headers["cache-control"]) == ("0.0", "no-cache")


def test_a_picture_has_two_layers(live: Bridge) -> None:
    pictures = [live.get("/api/estimate.png", **QUERY, layer=name) for name in ("mean", "sd")]
    assert [Image.open(io.BytesIO(each.content)).size for each in pictures] == [(4, 6)] * 2
    assert pictures[0].content != pictures[1].content
    accepted = live.get("/api/estimate", headers={"Accept": "image/png"}, **QUERY)
    assert (accepted.headers["content-type"], accepted.headers["vary"]) == ("image/png", "Accept")


def test_a_matching_etag_gets_304_until_a_new_scan_arrives(live: Bridge) -> None:
    def same_again() -> Any:
        first = live.get("/api/estimate", **QUERY)
        known = {"If-None-Match": first.headers["etag"]}
        again = live.get("/api/estimate", headers=known, **QUERY)
        return first if again.status_code == 304 else None

    first = wait_for(same_again, "no fit and no minute in between")
    assert live.get("/api/estimate.npy", **QUERY).headers["etag"] != first.headers["etag"]
    live.peer.observe(scan("a", {"temperature": 30.0}, at=PLACES["a"], stamp_s=now_s()))
    live.tag("a", lambda tag: tag["readings"][0]["value"] == 30.0)

    def is_of_all() -> bool:
        other = live.get("/api/estimate", headers={"If-None-Match": first.headers["etag"]}, **QUERY)
        return other.status_code == 200 and other.json()["reading_count"] == 19

    wait_for(is_of_all, "an estimate with what is in the log by then")


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"sensor_type": ""}, "sensor_type is '': string should have at least 1"),
        ({"resolution": 0}, "resolution is '0': input should be greater than 0"),
        ({"resolution": 0.0001}, "limit is 1000000 in all"),
        ({"sensor_type": "ph"}, "no tag has a reading of the 86400 s before that moment"),
        ({"at": 2**31 - 1}, "at is 2147483647.000000000 s, later than now"),
        ({"layer": "median"}, "layer is 'median': input should be 'mean' or 'sd'"),
        ({"layer": "sd"}, "layer is 'sd', but only a PNG has one"),
        ({"scale": 2}, "only a PNG can be scaled"),
        ({"lair": "sd"}, "parameter 'lair' is unknown, expected sensor_type, "),
    ],
)
def test_a_refusal_comes_from_the_service_with_its_reason(
    live: Bridge, changes: dict[str, Any], complaint: str
) -> None:
    response = live.get("/api/estimate", **{**QUERY, **changes})
    body = response.json()
    assert response.status_code == 400
    assert complaint in body["error_message"]
    assert set(body) == set(GetEstimateResponse.model_fields)
    assert live.get("/api/estimate", headers={"Accept": "text/css"}, **QUERY).status_code == 406
