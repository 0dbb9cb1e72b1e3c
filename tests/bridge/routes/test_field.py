"""The field over HTTP, compared with the ROS service of the same twin."""

import io
import json
import math
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from lupin_bridge.stream import routes_schema, schema
from tests.oracle_idw import field_by_loop
from tests.support.messages import discovered, occupancy_grid, pose, scan
from tests.support.processes import limits
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge

# These tests send more requests than a browser may.
EAGER = limits(answers_per_s=10_000)
SAMPLES = [(1.0, 1.0, 20.0), (2.0, 1.5, 24.0), (3.5, 0.5, 30.0)]
BOX = {"bbox_min_x": 0.0, "bbox_min_y": -0.5, "bbox_max_x": 6.0, "bbox_max_y": 3.0}
QUERY: dict[str, Any] = {"sensor_type": "temperature", "resolution": 0.25, **BOX}
FORMATS = ["json", "npy", "png"]


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    """A bridge whose twin has three samples of temperature, for reading only."""
    with bridge(*EAGER) as running:
        for number, (x, y, value) in enumerate(SAMPLES):
            running.peer.observe(scan(str(number), {"temperature": value}, at=(x, y)))
        running.peer.observe(scan("nan", {"temperature": math.nan}, at=(1.2, 1.2)))
        running.tag("nan")
        yield running


@pytest.fixture
def changing() -> Iterator[Bridge]:
    """A bridge for one test alone."""
    with bridge(*EAGER) as running:
        yield running


def npy(running: Bridge, **query: Any) -> npt.NDArray[np.float32]:
    answer = running.get("/api/field.npy", **query)
    assert answer.status_code == 200, answer.text
    return np.load(io.BytesIO(answer.content), allow_pickle=False)  # type: ignore[no-any-return]


def test_the_service_and_both_formats_give_the_numbers_of_the_definition(live: Bridge) -> None:
    service = live.peer.get_field(**QUERY)
    body = live.json("/api/field.json", **QUERY)
    array = npy(live, **QUERY)
    expected = field_by_loop(
        SAMPLES,
        width=24,
        height=14,
        bbox_min_x=0.0,
        bbox_min_y=-0.5,
        resolution=0.25,
        falloff_radius_m=1.5,
        max_distance_m=1.5,
        power=2.0,
    )
    assert (service.ok, service.width, service.height) == (True, 24, 14)
    assert any(map(math.isnan, expected))
    assert any(map(math.isfinite, expected))
    np.testing.assert_allclose(array.ravel(), np.array(expected, np.float32), rtol=1e-6)
    # From here on to the last bit, with NaN equal to NaN.
    np.testing.assert_array_equal(array.ravel(), np.array(service.values, np.float32))
    numbers = [math.nan if value is None else value for value in body.pop("values")]
    np.testing.assert_array_equal(array.ravel(), np.array(numbers, np.float32))
    for name, value in body.items():
        as_sent = np.float32(value) if isinstance(value, float) else value
        assert as_sent == getattr(service, name), name


@pytest.mark.parametrize(
    ("accept", "media_type", "suffix"),
    [
        (None, "application/json", "json"),
        ("image/webp,image/png;q=0.9,*/*;q=0.1", "image/png", "png"),
    ],
)
def test_accept_chooses_the_format_and_the_answer_varies_by_it(
    live: Bridge, accept: str | None, media_type: str, suffix: str
) -> None:
    answer = live.get("/api/field", {} if accept is None else {"Accept": accept}, **QUERY)
    assert answer.headers["content-type"] == media_type
    assert answer.headers["vary"] == "Accept"
    by_suffix = live.get(f"/api/field.{suffix}", {"Accept": "text/html"}, **QUERY)
    assert answer.content == by_suffix.content
    assert "vary" not in by_suffix.headers


def test_all_lines_of_a_header_count_and_an_unknown_format_is_json(live: Bridge) -> None:
    def request(*lines: tuple[str, str]) -> httpx.Response:
        url = f"{live.url}/api/field"
        return httpx.get(url, params=QUERY, headers=lines, timeout=PATIENCE_S, trust_env=False)

    two_types = request(("Accept", "text/html;q=0.1"), ("Accept", "application/x-npy"))
    assert two_types.headers["content-type"] == "application/x-npy"
    tag = etag(live, "/api/field.json")
    two_tags = request(("If-None-Match", '"other"'), ("If-None-Match", tag), ("Accept", "*/*"))
    assert two_tags.status_code == 304
    answer = request(("Accept", "text/html"))
    assert answer.headers["content-type"] == "application/json"


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_headers_of_every_format_describe_its_content(live: Bridge, suffix: str) -> None:
    headers = live.get(f"/api/field.{suffix}", **QUERY).headers
    values = [v for v in npy(live, **QUERY).ravel().tolist() if math.isfinite(v)]
    assert {name: v for name, v in headers.items() if name.startswith("x-field-")} == {
        "x-field-sensor": "temperature",
        "x-field-unit": "%C2%B0C",
        "x-field-width": "24",
        "x-field-height": "14",
        "x-field-origin-x": "0.0",
        "x-field-origin-y": "-0.5",
        "x-field-resolution": "0.25",
        "x-field-value-min": str(np.float32(min(values))),
        "x-field-value-max": str(np.float32(max(values))),
        "x-field-sample-count": "3",
    }
    assert headers["content-disposition"] == f'inline; filename="temperature.{suffix}"'
    assert headers["cache-control"] == "no-cache"


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"sensor_type": None}, ["sensor_type: field required"]),
        ({"resolution": 0}, ["resolution is '0'", "greater than 0"]),
        ({"resolution": "inf"}, ["resolution is inf", "finite"]),
        ({"bbox_min_x": 7.0}, ["bbox_min_x", "7.0", "bbox_max_x", "6.0"]),
        ({"bbox_min_y": None}, ["incomplete", "bbox_min_y is missing"]),
        ({"sensor": "co2"}, ["'sensor' is unknown", "expected sensor_type"]),
    ],
)
def test_a_bad_request_gets_the_failure_body_of_get_field(
    live: Bridge, change: dict[str, Any], named: list[str]
) -> None:
    query = {name: value for name, value in {**QUERY, **change}.items() if value is not None}
    for path in ("/api/field", *(f"/api/field.{suffix}" for suffix in FORMATS)):
        answer = live.get(path, **query)
        assert answer.status_code == 400
        refused = schema.GetFieldResponse.model_validate_json(answer.content)
        assert not refused.ok
        for words in named:
            assert words in refused.error_message
        rest = refused.model_dump(exclude={"ok", "error_message", "values"})
        assert (rest, refused.values) == (dict.fromkeys(rest, 0), [])
        assert answer.headers["cache-control"] == "no-store"


@pytest.mark.parametrize(("resolution", "far"), [(1e-45, 3.4e38), (0.001, 1_001.0)])
def test_an_oversized_grid_is_refused_over_http_as_over_ros(
    live: Bridge, resolution: float, far: float
) -> None:
    bomb: dict[str, Any] = {"sensor_type": "co2", "resolution": resolution}
    bomb |= {"bbox_min_x": 0.0, "bbox_min_y": 0.0, "bbox_max_x": far, "bbox_max_y": far}
    service = live.peer.get_field(**bomb)
    answer = live.get("/api/field.png", **bomb)
    assert (service.ok, answer.status_code) == (False, 400)
    assert answer.json()["error_message"] == service.error_message
    assert "the limit is 1000000" in service.error_message


def etag(running: Bridge, path: str = "/api/field.json", **query: Any) -> str:
    answer = running.get(path, **(query or QUERY))
    assert answer.status_code == 200, answer.text
    return answer.headers["etag"]


def work_done(running: Bridge) -> str:
    """How many fields were computed, cached or awaited so far, by the metrics."""
    name = "lupin_field_seconds_count "
    (line,) = (line for line in running.get("/metrics").text.splitlines() if line.startswith(name))
    return line


@pytest.mark.parametrize("path", ["/api/field", "/api/field.png", "/api/field/quality"])
def test_an_unchanged_field_is_not_sent_again(live: Bridge, path: str) -> None:
    tag, before = etag(live, path), work_done(live)
    for known in (tag, f"W/{tag}", f'"other", {tag}', "*"):
        again = live.get(path, {"If-None-Match": known}, **QUERY)
        assert (again.status_code, again.content) == (304, b"")
        assert again.headers["etag"] == tag
        assert again.headers["cache-control"] == "no-cache"
    assert work_done(live) == before, "neither computed nor looked up"
    for other in ('"other"', tag[:-2] + '"', tag.strip('"'), tag[:-1]):
        assert live.get(path, {"If-None-Match": other}, **QUERY).status_code == 200


def test_an_etag_holds_until_the_field_could_have_changed(changing: Bridge) -> None:
    def changed_from(old: str) -> str:
        def check() -> str | None:
            answer = changing.get("/api/field", {"If-None-Match": old}, **QUERY)
            return answer.headers["etag"] if answer.status_code == 200 else None

        return str(changing.peer.until(check, "a new ETag"))

    first = etag(changing)
    changing.peer.observe(scan("1", {"temperature": 20.0}))
    observed = changed_from(first)
    changing.peer.discover(discovered({"1": pose(1.0, 1.0)}))
    pinned = changed_from(observed)
    assert changing.json("/api/field", **QUERY)["sample_count"] == 1
    changing.peer.publish_map(occupancy_grid([[0]]))
    mapped = changed_from(pinned)
    # A repeated discovery, and a message from another frame, change nothing.
    changing.peer.discover(discovered({"1": pose(5.0, 5.0)}))
    changing.peer.observe(scan("2", {"temperature": 1.0}, frame_id="odom"))
    with changing.listen() as listener:
        for _ in range(2):
            listener.until("state")
    assert changing.get("/api/field", {"If-None-Match": mapped}, **QUERY).status_code == 304


def test_only_with_clip_to_explored_a_live_field_ends_where_the_map_does(
    changing: Bridge,
) -> None:
    changing.peer.observe(scan("1", {"temperature": 20.0}, at=(1, 1)))
    observed = changing.tag("1")["last_observed"]
    whole = changing.json("/api/field", **QUERY)["values"]
    before = etag(changing)
    # The cells of x < 1 m and y < 1 m are known.
    changing.peer.publish_map(occupancy_grid([[0, -1], [-1, -1]]))
    wait_for(lambda: etag(changing) != before, "the map")
    assert changing.json("/api/field", **QUERY)["values"] == whole
    wanted = Parameter("clip_to_explored", value=True).to_parameter_msg()
    service = "/lupin_twin/set_parameters"
    [result] = changing.peer.call(SetParameters, service, parameters=[wanted]).results
    assert result.successful, result.reason

    def known() -> int:
        return int(np.isfinite(npy(changing, **QUERY)).sum())

    wait_for(lambda: known() < sum(value is not None for value in whole), "the clipped field")
    clipped = npy(changing, **QUERY)
    np.testing.assert_array_equal(changing.peer.get_field(**QUERY).values, clipped.ravel())
    assert np.isfinite(clipped[2:6, :4]).any()
    assert np.isnan(clipped[6:]).all()
    assert np.isnan(clipped[:, 4:]).all()
    # The log does not have the map of a past moment.
    at = observed["sec"] + 1
    wait_for(lambda: changing.get("/api/state", at=at).status_code == 200, "that moment")
    assert changing.json("/api/field", **QUERY, at=at)["values"] == whole


def test_quality_describes_the_requested_field(live: Bridge) -> None:
    quality = routes_schema.FieldQuality.model_validate(live.json("/api/field/quality", **QUERY))
    values = npy(live, **QUERY)
    assert quality.sensor_type == "temperature"
    assert quality.painted_share == pytest.approx(np.isfinite(values).mean())
    assert quality.sample_count == 3


def test_readings_past_float32_do_not_break_the_answer(changing: Bridge) -> None:
    changing.peer.observe(
        scan("1", {"temperature": 1e300}, at=(1, 1)), scan("2", {"temperature": 3.0}, at=(2, 1))
    )
    changing.tag("2")
    for suffix in FORMATS:
        assert changing.get(f"/api/field.{suffix}", **QUERY).status_code == 200
    text = changing.get("/api/field.json", **QUERY).text
    json.loads(text, parse_constant=pytest.fail)
    schema.GetFieldResponse.model_validate_json(text, strict=True)


def test_a_picture_is_the_array_turned_over(live: Bridge) -> None:
    array = npy(live, **QUERY)
    answer = live.get("/api/field.png", **QUERY, scale=3)
    with Image.open(io.BytesIO(answer.content)) as image:
        image.load()
        assert image.size == (24 * 3, 14 * 3)
        assert image.text["Sample-Count"] == "3"  # type: ignore[attr-defined]
        alpha = np.asarray(image.convert("RGBA"))[:, :, 3]
    cells = np.flipud(alpha[1::3, 1::3]).astype(float)
    span = np.nanmax(array) - np.nanmin(array)
    expected = np.nan_to_num((array - np.nanmin(array)) / span * 153)
    np.testing.assert_allclose(cells, expected, atol=0.81)
