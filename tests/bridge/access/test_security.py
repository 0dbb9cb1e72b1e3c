"""What holds for every answer of a live bridge: no writing, and the security headers."""

from collections.abc import Iterator

import httpx
import pytest

from lupin_bridge.stream import schema
from tests.support.access import OWN
from tests.support.messages import occupancy_grid, scan
from tests.support.web import ROUTES, Bridge, bridge

PATHS = [path.replace("{tag_id}", "7") for path in ROUTES]
ELSEWHERE = ["/", "/nowhere", "/ws/state"]
QUERY = {"sensor_type": "co2", "resolution": "0.5"}
IN_CELLS = {path for path in PATHS if "field" in path or "estimate" in path}
SENSOR = {"sensor_type": "co2"}
OF_SENSOR = {f"/api/estimate/{name}" for name in ("advice", "quality", "tags")}
POSTED = ("/api/signin", "/api/signout")
SERIES = {"tag_id": "7", "sensor_type": "co2"}
# Without an end, a period ends now, and its file name contains that second.
PERIOD = {"from": "1", "to": "5"}
PAST = {"/api/history": SERIES, "/api/timeline": {}, "/api/export.csv": {}}


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    with bridge() as running:
        running.peer.observe(scan("7", {"co2": 400.0}, at=(1, 1)))
        running.peer.publish_map(occupancy_grid([[0]]))
        running.tag("7")
        running.peer.until(lambda: running.get("/api/map").status_code == 200, "the map")
        yield running


def send(live: Bridge, method: str, path: str) -> httpx.Response:
    query = PAST[path] | PERIOD if path in PAST else QUERY if path in IN_CELLS else None
    return live.http.request(method, path, params=query if path not in OF_SENSOR else SENSOR)


@pytest.mark.parametrize("path", PATHS)
def test_head_is_get_without_the_body(live: Bridge, path: str) -> None:
    got, head = (send(live, method, path) for method in ("GET", "HEAD"))
    assert (got.status_code, head.status_code, head.content) == (200, 200, b"")
    assert got.content
    # The other headers depend on the time: lengths, ETags, file names.
    for name in ("content-type", "cache-control", "vary"):
        assert head.headers.get(name) == got.headers.get(name), name


@pytest.mark.parametrize("path", [*(path for path in PATHS if path != "/api/notes"), *ELSEWHERE])
@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE", "BREW"])
def test_any_method_but_a_read_is_refused(live: Bridge, path: str, method: str) -> None:
    answer = send(live, method, path)
    assert answer.status_code == 405
    assert answer.headers["allow"] == "GET, HEAD"
    message = schema.ErrorMessage.model_validate_json(answer.content)
    assert message.detail == f"method {method} is not allowed here, use GET or HEAD"


@pytest.mark.parametrize("path", POSTED)
def test_signing_in_and_out_needs_post_with_a_header_that_no_form_can_send(
    live: Bridge, path: str
) -> None:
    for method in ("GET", "HEAD", "PUT", "DELETE", "OPTIONS"):
        answer = live.http.request(method, path, headers=OWN)
        assert (answer.status_code, answer.headers["allow"]) == (405, "POST"), method
    answer = live.http.post(path)
    assert answer.status_code == 403
    assert answer.json() == {"detail": "POST without the header X-Lupin-Twin, expected any value"}
    assert live.http.post(path, headers=OWN).status_code == 404, "this bridge needs no token"


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/api/state", 200),
        ("GET", "/docs", 200),
        ("GET", "/api/field.png?sensor_type=co2", 200),
        ("GET", "/api/field", 400),
        ("GET", "/nowhere", 404),
        ("POST", "/api/state", 405),
    ],
)
def test_every_answer_has_the_security_headers(
    live: Bridge, method: str, path: str, status: int
) -> None:
    answer = live.http.request(method, path)
    assert answer.status_code == status
    policy = dict(
        part.strip().split(" ", 1) for part in answer.headers["content-security-policy"].split(";")
    )
    assert policy["default-src"] == policy["connect-src"] == "'self'"
    assert policy["img-src"] == "'self' blob: data:"
    assert policy["object-src"] == policy["base-uri"] == policy["frame-ancestors"] == "'none'"
    assert "script-src" not in policy, "the default allows no inline script"
    assert "unsafe" not in answer.headers["content-security-policy"]
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["x-frame-options"] == "DENY"
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert answer.headers["cross-origin-opener-policy"] == "same-origin"
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert "server" not in answer.headers
