"""The estimate over HTTP, compared with the ROS service of the same twin; its accuracy."""

import io
import math
import time
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from lupin_msgs.srv import GetEstimate
from PIL import Image

from lupin_bridge.stream.estimate_schema import (
    Advice,
    EstimateQualities,
    ExpectedTags,
    GetEstimateResponse,
)
from lupin_twin.core.state import Pin, Pose, Write
from lupin_twin.journal.runs import Clock
from tests.support.journal import SECOND, append
from tests.support.journal import scan as row
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
        ({"resolution": 0}, "resolution is '0': input should be greater than 0"),
        ({"resolution": 0.0001}, "limit is 1000000 in all"),
        ({"sensor_type": "ph"}, "no tag has a reading of this sensor_type in the 86400 s"),
        ({"at": 2**31 - 1}, "at is 2147483647.000000000 s, later than now"),
        ({"layer": "median"}, "layer is 'median': input should be 'mean' or 'sd'"),
        ({"layer": "sd"}, "layer is 'sd', but only a PNG has one"),
        ({"scale": 2}, "only a PNG can be scaled"),
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


TAGS = {"a": (0.5, 0.5), "b": (1.75, 2.75), "c": (0.5, 2.0), "d": (2.5, 1.0)}
SENSOR = {"sensor_type": "temperature"}


def temperature(tag_id: str, half_hours_ago: int) -> float:
    value = 20.0 + 0.3 * TAGS[tag_id][0]
    value += 0.1 * math.sin(half_hours_ago + list(TAGS).index(tag_id))
    return value + (9.0 if tag_id == "d" and half_hours_ago <= 4 else 0.0)


@pytest.fixture(scope="module")
def graded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bridge]:
    """A bridge whose twin has ten hours of four tags; one reads 9 K too much in the last two.

    From a journal: scan by scan, a report would be ready before the last scan arrives.
    """
    journal, begun_ns = tmp_path_factory.mktemp("journal") / "j.sqlite", now_s() * SECOND
    placed_ns = (now_s() - 20 * 1800) * SECOND
    rows: list[Write] = [
        Pin(tag_id, Pose(*at, 0.0, 0.0, 0.0, 0.0, 1.0), placed_ns, placed_ns)
        for tag_id, at in TAGS.items()
    ]
    rows += [
        row(
            tag_id, (now_s() - 1800 * hour + 60 * n) * SECOND, temperature=temperature(tag_id, hour)
        )
        for hour in range(20, 0, -1)
        for n, tag_id in enumerate(TAGS)
    ]
    rows.append(row("nowhere", begun_ns, co2=1.0))
    append(journal, rows, Clock(begun_ns, begun_ns, is_simulated=False))
    journaled = ("--ros-args", "-p", f"journal:={journal}")
    with bridge(*limits(answers_per_s=10_000), *journaled) as running:
        yield running


def answered(graded: Bridge, path: str, accept: Any, **query: Any) -> Any:
    def check() -> Any:
        body = graded.json(path, **query)
        return body if accept(body) else None

    return wait_for(check, path)


def test_a_changed_tag_is_reported_left_out_and_judged(graded: Bridge) -> None:
    def is_of_the_last(body: Any) -> bool:
        # Predictions run beside the ingest, and may be from the scan before.
        reported = body["tags"].get("d")
        return bool(
            reported and reported["left_out"] and reported["measured"] == temperature("d", 1)
        )

    body = answered(graded, "/api/estimate/tags", is_of_the_last, **SENSOR)
    ExpectedTags.model_validate(body)
    assert {tag_id: tag["left_out"] for tag_id, tag in body["tags"].items()} == {
        **dict.fromkeys("abc", False),
        "d": True,
    }
    odd = body["tags"]["d"]
    assert odd["offset"] == pytest.approx(9.0, abs=2.0)
    assert odd["measured"] - odd["expected"] > 6.0
    assert odd["observed_at"]["sec"] == now_s() - 1800 + 60 * list(TAGS).index("d")
    assert 0.0 < odd["expected_sd"] < 3.0 < odd["z"]
    estimate = graded.json("/api/estimate", **SENSOR, resolution=0.5)
    # All twenty of each tag, without those since the change.
    assert (estimate["sample_count"], estimate["reading_count"]) == (4, 20 * len(TAGS) - 4)
    reasons = answered(
        graded, "/api/health", lambda body: "changed" in str(body["tags"]["d"]["reasons"])
    )["tags"]["d"]["reasons"]
    [reason] = [one for one in reasons if one["kind"] == "changed"]
    assert (reason["verdict"], reason["sensor"], reason["limit"]) == (
        "stressed",
        "temperature",
        None,
    )
    assert reason["value"] == odd["measured"]
    assert now_s() - 4 * 1800 <= reason["since"]["sec"] < now_s()


def test_the_hit_rate_is_reported_for_all_sensors_or_for_one(graded: Bridge) -> None:
    both = graded.json("/api/estimate/quality")
    EstimateQualities.model_validate(both)
    assert list(both["sensors"]) == ["temperature"], "co2 has no place"
    one = graded.json("/api/estimate/quality", sensor_type="co2")["sensors"]["co2"]
    assert (one["fitted_at"], one["is_trusted"]) == (None, None)


def test_a_report_as_of_a_moment_is_that_of_the_log_up_to_then(graded: Bridge) -> None:
    """At that moment, the last scan of the tag was the first one that was off."""
    at = now_s() - 4 * 1800 + 600
    tags = graded.json("/api/estimate/tags", **SENSOR, at=at)
    assert tags["at"]["sec"] == at
    assert tags["tags"]["d"]["measured"] == temperature("d", 4)
    assert not tags["tags"]["d"]["left_out"], "one reading is no change"
    quality = graded.get("/api/estimate/quality", sensor_type="temperature", at=at)
    assert quality.json()["sensors"]["temperature"]["fitted_at"]["sec"] == at
    etag = quality.headers["etag"]
    path = f"/api/estimate/quality?sensor_type=temperature&at={at}"
    assert graded.get(path, {"If-None-Match": etag}).status_code == 304
    later = graded.get(f"/api/estimate/tags?sensor_type=co2&at={now_s() + 86_400}")
    assert later.status_code == 400
    assert "later than now" in later.json()["detail"]


def test_where_another_tag_would_help_is_reported_with_its_gain(graded: Bridge) -> None:
    body = answered(graded, "/api/estimate/advice", lambda body: body["places"], **SENSOR, places=3)
    Advice.model_validate(body)
    ratios = [place["error_ratio"] for place in body["places"]]
    assert len(ratios) == 3
    assert ratios == sorted(ratios, reverse=True)
    for place in body["places"]:
        apart = [math.dist((place["x"], place["y"]), at) for at in TAGS.values()]
        assert min(apart) >= 0.5


@pytest.mark.parametrize(
    ("path", "query", "complaint"),
    [
        ("advice", {**SENSOR, "places": 21}, "places is '21': input should be less than or equ"),
        ("advice", {}, "sensor_type: field required"),
        ("tags", {}, "sensor_type: field required"),
        ("tags", {**SENSOR, "to": 1}, "parameter 'to' is unknown"),
    ],
)
def test_a_refusal_names_the_mistake(
    graded: Bridge, path: str, query: dict[str, Any], complaint: str
) -> None:
    response = graded.get(f"/api/estimate/{path}", **query)
    assert response.status_code == 400
    assert complaint in response.json()["detail"]
