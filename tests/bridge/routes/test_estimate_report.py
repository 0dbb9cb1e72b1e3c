"""How accurate estimates are over HTTP, and how a changed sensor is reported."""

import math
import time
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest

from lupin_bridge.stream.pollers import Advice, EstimateQualities, ExpectedTags
from lupin_twin.core.state import Pin, Pose, Write
from lupin_twin.journal.runs import Clock
from tests.support.journal import SECOND, append, scan
from tests.support.processes import limits
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge

PLACES = {"a": (0.5, 0.5), "b": (1.75, 2.75), "c": (0.5, 2.0), "d": (2.5, 1.0)}
SENSOR = {"sensor_type": "temperature"}


@cache
def now_s() -> int:
    """The time of the first test here: test files are imported long before the last one runs."""
    return int(time.time())


def temperature(tag_id: str, half_hours_ago: int) -> float:
    value = 20.0 + 0.3 * PLACES[tag_id][0]
    value += 0.1 * math.sin(half_hours_ago + list(PLACES).index(tag_id))
    return value + (9.0 if tag_id == "d" and half_hours_ago <= 4 else 0.0)


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bridge]:
    """A bridge whose twin has ten hours of four tags; one reads 9 K too much in the last two.

    From a journal: scan by scan, a report would be ready before the last scan arrives.
    """
    journal, begun_ns = tmp_path_factory.mktemp("journal") / "j.sqlite", now_s() * SECOND
    placed_ns = (now_s() - 20 * 1800) * SECOND
    rows: list[Write] = [
        Pin(tag_id, Pose(*at, 0.0, 0.0, 0.0, 0.0, 1.0), placed_ns, placed_ns)
        for tag_id, at in PLACES.items()
    ]
    rows += [
        scan(
            tag_id, (now_s() - 1800 * hour + 60 * n) * SECOND, temperature=temperature(tag_id, hour)
        )
        for hour in range(20, 0, -1)
        for n, tag_id in enumerate(PLACES)
    ]
    rows.append(scan("nowhere", begun_ns, co2=1.0))
    append(journal, rows, Clock(begun_ns, begun_ns, is_simulated=False))
    journaled = ("--ros-args", "-p", f"journal:={journal}")
    with bridge(*limits(answers_per_s=10_000), *journaled) as running:
        yield running


def answered(live: Bridge, path: str, accept: Any, **query: Any) -> Any:
    def check() -> Any:
        body = live.json(path, **query)
        return body if accept(body) else None

    return wait_for(check, path)


def test_a_changed_tag_is_reported_left_out_and_judged(live: Bridge) -> None:
    def is_of_the_last(body: Any) -> bool:
        # Predictions run beside the ingest, and may be from the scan before.
        reported = body["tags"].get("d")
        return bool(
            reported and reported["left_out"] and reported["measured"] == temperature("d", 1)
        )

    body = answered(live, "/api/estimate/tags", is_of_the_last, **SENSOR)
    ExpectedTags.model_validate(body)
    assert {tag_id: tag["left_out"] for tag_id, tag in body["tags"].items()} == {
        **dict.fromkeys("abc", False),
        "d": True,
    }
    odd = body["tags"]["d"]
    assert odd["offset"] == pytest.approx(9.0, abs=2.0)
    assert odd["measured"] - odd["expected"] > 6.0
    assert odd["observed_at"]["sec"] == now_s() - 1800 + 60 * list(PLACES).index("d")
    assert 0.0 < odd["expected_sd"] < 3.0 < odd["z"]
    estimate = live.json("/api/estimate", **SENSOR, resolution=0.5)
    # All twenty of each tag, without those since the change.
    assert (estimate["sample_count"], estimate["reading_count"]) == (4, 20 * len(PLACES) - 4)
    reasons = answered(
        live, "/api/health", lambda body: "changed" in str(body["tags"]["d"]["reasons"])
    )["tags"]["d"]["reasons"]
    [reason] = [one for one in reasons if one["kind"] == "changed"]
    assert (reason["verdict"], reason["sensor"], reason["limit"]) == (
        "stressed",
        "temperature",
        None,
    )
    assert reason["value"] == odd["measured"]
    assert now_s() - 4 * 1800 <= reason["since"]["sec"] < now_s()
    metrics = live.get("/metrics").text
    assert "lupin_estimate_trusted{" not in metrics, "four tags are too few to say"
    assert 'lupin_estimate_fit_failing{sensor="temperature"} 0.0' in metrics


def test_the_hit_rate_is_reported_for_all_sensors_or_for_one(live: Bridge) -> None:
    both = live.json("/api/estimate/quality")
    EstimateQualities.model_validate(both)
    assert list(both["sensors"]) == ["temperature"], "co2 has no place"
    one = live.json("/api/estimate/quality", sensor_type="co2")["sensors"]["co2"]
    assert (one["fitted_at"], one["is_trusted"]) == (None, None)


def test_a_report_as_of_a_moment_is_that_of_the_log_up_to_then(live: Bridge) -> None:
    """At that moment, the last scan of the tag was the first one that was off."""
    at = now_s() - 4 * 1800 + 600
    tags = live.json("/api/estimate/tags", **SENSOR, at=at)
    assert tags["at"]["sec"] == at
    assert tags["tags"]["d"]["measured"] == temperature("d", 4)
    assert not tags["tags"]["d"]["left_out"], "one reading is no change"
    quality = live.get("/api/estimate/quality", sensor_type="temperature", at=at)
    assert quality.json()["sensors"]["temperature"]["fitted_at"]["sec"] == at
    etag = quality.headers["etag"]
    path = f"/api/estimate/quality?sensor_type=temperature&at={at}"
    assert live.get(path, {"If-None-Match": etag}).status_code == 304
    later = live.get(f"/api/estimate/tags?sensor_type=co2&at={now_s() + 86_400}")
    assert later.status_code == 400
    assert "later than now" in later.json()["detail"]


def test_where_another_tag_would_help_is_reported_with_its_gain(live: Bridge) -> None:
    body = answered(live, "/api/estimate/advice", lambda body: body["places"], **SENSOR, places=3)
    Advice.model_validate(body)
    ratios = [place["error_ratio"] for place in body["places"]]
    assert len(ratios) == 3
    assert ratios == sorted(ratios, reverse=True)
    for place in body["places"]:
        apart = [math.dist((place["x"], place["y"]), at) for at in PLACES.values()]
        assert min(apart) >= 0.5


@pytest.mark.parametrize(
    ("path", "query", "complaint"),
    [
        (
            "advice",
            {**SENSOR, "places": 21},
            "places is '21': input should be less than or equal to 20",
        ),
        ("advice", {**SENSOR, "places": "x"}, "places is 'x': input should be a valid integer"),
        ("advice", {}, "sensor_type: field required"),
        ("tags", {}, "sensor_type: field required"),
        ("tags", {**SENSOR, "to": 1}, "parameter 'to' is unknown"),
        ("quality", {"sensor_type": ""}, "sensor_type is '': string should have"),
    ],
)
def test_a_refusal_names_the_mistake(
    live: Bridge, path: str, query: dict[str, Any], complaint: str
) -> None:
    response = live.get(f"/api/estimate/{path}", **query)
    assert response.status_code == 400
    assert complaint in response.json()["detail"]
