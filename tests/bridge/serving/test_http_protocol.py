"""Answers are sent as fast as they are read: in pieces, and not at all to a stuck reader."""

import contextlib
from collections.abc import Iterator

import pytest

from tests.support import raw_http
from tests.support.access import Served, served
from tests.support.processes import limits
from tests.support.waiting import wait_for
from tests.support.web import deaf_client

# 1,000,000 cells, 5 MB of JSON: more than two sockets buffer.
LARGE_FIELD = (
    "/api/field.json?sensor_type=co2&resolution=0.01"
    "&bbox_min_x=0&bbox_min_y=0&bbox_max_x=10&bbox_max_y=10"
)
SMALL_FIELD = LARGE_FIELD.replace("0.01", "10")
CONCURRENCY = 3
TIMEOUT_S = 3


@pytest.fixture(scope="module")
def live() -> Iterator[Served]:
    options = limits(client_timeout_s=TIMEOUT_S, concurrency=CONCURRENCY)
    with served(*options) as running:
        yield running


def test_a_large_field_arrives_whole(live: Served) -> None:
    with live.client() as client:  # on one connection: each answer has an end
        response, head = client.get(LARGE_FIELD), client.head(LARGE_FIELD)
    assert len(response.content) == int(response.headers["content-length"]) > 4_000_000
    assert len(response.json()["values"]) == 1_000_000
    assert (head.content, head.headers["content-length"]) == (
        b"",
        response.headers["content-length"],
    )
    assert "ERROR" not in live.process.output


def test_stuck_readers_hold_only_their_own_places_and_are_cut_off(live: Served) -> None:
    refused = f"has {CONCURRENCY} requests for computed answers in flight, the limit"
    with contextlib.ExitStack() as readers:
        # For one cached field, the number of readers is not limited, and all may be stuck.
        large = [LARGE_FIELD.replace("co2", f"co2_{number}") for number in range(CONCURRENCY)]
        deaf = [readers.enter_context(deaf_client(live.url, field)) for field in large]
        wait_for(lambda: refused in live.get(SMALL_FIELD).text, "the deaf readers' places")
        with live.client("127.0.4.1") as other:
            assert other.get(SMALL_FIELD).status_code == 200, "it is another client"
        line = f"disconnected a reader that accepted nothing for {TIMEOUT_S} s"
        wait_for(lambda: live.process.output.count(line) == CONCURRENCY, "their end")
        assert all(len(raw_http.received(client)) < 4_000_000 for client in deaf)
    wait_for(lambda: live.get(SMALL_FIELD).status_code == 200, "their places to be free")
    assert "ERROR" not in live.process.output
