"""The map: none before the first message, then its place and its picture, pixel by pixel."""

from collections.abc import Iterator
from itertools import count

import httpx
import pytest
from geometry_msgs.msg import Point, Pose

from lupin_bridge.stream import schema
from tests.support.messages import occupancy_grid, scan
from tests.support.web import Bridge, bridge

ROWS = [[0, 100, -1], [-1, 50, 0]]
NOWHERE_YET = count()


@pytest.fixture(scope="module")
def mapped() -> Iterator[Bridge]:
    with bridge() as running:
        yield running


def put_map(running: Bridge, rows: list[list[int]], origin: Pose | None = None) -> str:
    """Publish a map and wait until it is served; returns its ETag.

    Without an origin, the map gets one never used before: a repeated map is no news.
    """
    before = running.get("/api/map").headers.get("etag")
    origin = origin or Pose(position=Point(x=float(next(NOWHERE_YET))))
    running.peer.publish_map(occupancy_grid(rows, 0.05, origin))

    def check() -> str | None:
        tag = running.get("/api/map").headers.get("etag")
        return tag if tag != before else None

    return str(running.peer.until(check, "the new map"))


def test_a_map_is_fetched_again_only_when_it_has_changed(mapped: Bridge) -> None:
    old = put_map(mapped, [[0]])
    for path in ("/api/map", "/api/map.png"):
        first = mapped.get(path)
        assert first.headers["cache-control"] == "no-cache"
        again = mapped.get(path, {"If-None-Match": first.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")
        assert again.headers["etag"] == first.headers["etag"]
    assert mapped.get("/api/map").headers["etag"] != mapped.get("/api/map.png").headers["etag"]
    assert put_map(mapped, ROWS) != old
    assert mapped.get("/api/map", {"If-None-Match": old}).status_code == 200


def test_a_websocket_client_learns_of_a_new_map_by_the_revision(mapped: Bridge) -> None:
    with mapped.listen() as listener:
        # From the maps so far: a frame under way may be from before another test's map.
        mapped.peer.observe(scan("by now"))
        before = listener.until_tag("by now")["revision"]
        mapped.peer.publish_map(occupancy_grid([[100, -1]]))
        listener.until("state", lambda frame: frame["revision"] != before)


def test_a_restarted_bridge_has_no_map_at_first_and_matches_no_earlier_etag(domain: int) -> None:
    paths = ("/api/map", "/api/field.json?sensor_type=temperature")
    first: dict[str, httpx.Response] = {}
    for _ in range(2):
        with bridge(domain=domain) as running:
            for path in ("/api/map", "/api/map.png"):
                answer = running.get(path)
                message = schema.ErrorMessage.model_validate_json(answer.content)
                assert answer.status_code == 404
                assert message.detail == "no map has been received yet on the twin's map_topic"
            put_map(running, ROWS, Pose())
            running.peer.observe(scan("1", {"temperature": 20.0}, at=(0.1, 0.1)))
            running.tag("1")
            first = first or {path: running.get(path) for path in paths}
            has = {path: {"If-None-Match": first[path].headers["etag"]} for path in paths}
            again = {path: running.get(path, has[path]) for path in paths}
    for path in paths:
        assert again[path].content == first[path].content, "the same thing"
        assert again[path].status_code == 200, "under another tag"
