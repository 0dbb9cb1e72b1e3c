"""Field requests: how many and how often, each client by itself and all together."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from lupin_bridge.field.limits import BURST_S, BusyError, ClientLimitError, FieldLimits
from lupin_bridge.settings import Settings
from lupin_bridge.stream import schema
from tests.support.access import Served, served
from tests.support.inprocess import run, running

ROUTES = ("/api/field", "/api/field.json", "/api/field.png", "/api/field.npy", "/api/field/quality")
QUERY = "?sensor_type=co2&resolution=1&bbox_min_x=0&bbox_min_y=0&bbox_max_x=4&bbox_max_y=4"


# --- the rules ----------------------------------------------------------------------------------


def test_a_client_has_its_number_in_flight_and_the_next_is_refused_by_name() -> None:
    limits = FieldLimits(rate_hz=1000.0, concurrency=2, total_concurrency=10)
    with limits.request("a", 0.0):
        with limits.request("a", 0.0), limits.request("b", 0.0):
            with pytest.raises(ClientLimitError) as refused, limits.request("a", 0.0):
                pytest.fail("let in")
            assert str(refused.value) == (
                "a has 2 field requests in flight, the limit (field_concurrency)"
            )
            assert refused.value.headers == {"Retry-After": "1"}
        with limits.request("a", 0.0):
            pass


def test_a_request_that_fails_gives_its_place_back() -> None:
    limits = FieldLimits(rate_hz=1000.0, concurrency=1, total_concurrency=1)
    for _ in range(3):
        with pytest.raises(ZeroDivisionError), limits.request("a", 0.0), limits.computing():
            raise ZeroDivisionError


def test_a_client_has_its_rate_and_is_told_when_to_come_back() -> None:
    limits = FieldLimits(rate_hz=0.5, concurrency=9, total_concurrency=9)
    with limits.request("a", 0.0):
        pass
    with pytest.raises(ClientLimitError) as refused, limits.request("a", 0.25):
        pytest.fail("let in")
    assert (
        str(refused.value) == "a asks for more than 0.5 fields a second, the limit (field_rate_hz)"
    )
    assert refused.value.retry_after_s == pytest.approx(1.75)
    assert refused.value.headers == {"Retry-After": "2"}
    with limits.request("b", 0.25), limits.request("a", 2.0):
        pass


def test_a_request_refused_for_its_number_costs_no_turn() -> None:
    limits = FieldLimits(rate_hz=1.0, concurrency=1, total_concurrency=9)
    with limits.request("a", 0.0):
        for _ in range(100):
            with pytest.raises(ClientLimitError, match="in flight"), limits.request("a", 0.0):
                pytest.fail("let in")
    with limits.request("a", 0.0):
        pass


def test_all_together_have_a_number_too() -> None:
    limits = FieldLimits(rate_hz=1.0, concurrency=1, total_concurrency=2)
    with limits.computing():
        with limits.computing(), pytest.raises(BusyError) as refused, limits.computing():
            pytest.fail("let in")
        assert str(refused.value) == (
            "2 fields are being computed, the limit (field_total_concurrency)"
        )
        with limits.computing():
            pass


def test_clients_that_are_gone_leave_nothing_behind() -> None:
    limits = FieldLimits(rate_hz=1000.0, concurrency=1, total_concurrency=1)
    for number in range(100):
        with limits.request(f"client {number}", 0.0):
            assert len(limits._in_flight) == 1
    assert not limits._in_flight


# --- at the routes ------------------------------------------------------------------------------

RATE_HZ = 0.1
BURST = max(1, math.floor(RATE_HZ * BURST_S))


@pytest.fixture(scope="module")
def slow() -> Iterator[Served]:
    with served("--field-rate-hz", str(RATE_HZ)) as running_bridge:
        yield running_bridge


@pytest.mark.parametrize("route", ROUTES)
def test_every_route_of_a_field_has_the_limit(slow: Served, route: str) -> None:
    with slow.client(address=f"127.0.1.{ROUTES.index(route) + 1}") as client:
        first, second = client.get(route + QUERY), client.get(route + QUERY)
        assert first.status_code == 200
        assert second.status_code == 429
        assert 1 <= int(second.headers["retry-after"]) <= 1 / RATE_HZ
        refusal = schema.GetFieldResponse.model_validate_json(second.content)
        assert not refusal.ok
        assert (refusal.values, refusal.width, refusal.sample_count) == ([], 0, 0)
        assert "for more than 0.1 fields a second, the limit (field_rate_hz)" in (
            refusal.error_message
        )


def test_what_needs_no_computing_costs_no_turn(slow: Served) -> None:
    with slow.client(address="127.0.2.1") as client:
        for _ in range(5):
            assert client.get("/api/field?sensor_type=co2&resolution=-1").status_code == 400
        tag = client.get("/api/field" + QUERY).headers["etag"]
        for _ in range(5):
            known = client.get("/api/field" + QUERY, headers={"If-None-Match": tag})
            assert (known.status_code, known.content) == (304, b"")
        assert client.get("/api/field" + QUERY).status_code == 429
        assert client.get("/api/state").status_code == 200, "only fields are limited"


def test_a_client_past_its_limit_holds_up_no_other(slow: Served) -> None:
    with slow.client("127.0.3.1") as greedy, slow.client("127.0.3.2") as modest:
        answers = [greedy.get("/api/field" + QUERY).status_code for _ in range(20)]
        assert answers == [200] * BURST + [429] * (20 - BURST)
        assert modest.get("/api/field" + QUERY).status_code == 200


def test_with_all_places_taken_it_is_503_until_one_is_free(domain: int) -> None:
    async def test() -> None:
        async with running(Settings(field_total_concurrency=2)) as it:
            with ExitStack() as taken:
                for _ in range(2):
                    taken.enter_context(it.bridge.field_limits.computing())
                busy = await it.http.get("/api/field" + QUERY)
                assert busy.status_code == 503
                assert busy.headers["retry-after"] == "1"
                assert "the limit (field_total_concurrency)" in busy.json()["detail"]
            free = await asyncio.gather(*(it.http.get("/api/field" + QUERY) for _ in range(2)))
            assert [answer.status_code for answer in free] == [200, 200]

    run(domain, test())


def test_a_place_is_held_until_the_twin_has_answered_and_then_given_back(domain: int) -> None:
    """Of a twin that does not answer, no more clients wait than the limit allows."""

    async def never(_work: object) -> None:
        await asyncio.Event().wait()

    async def test() -> None:
        async with running(Settings(field_concurrency=3, field_timeout_s=0.5)) as it:
            it.twin._thread.call = never  # type: ignore[method-assign, assignment]
            answers = await asyncio.gather(*(it.http.get("/api/field" + QUERY) for _ in range(8)))
            assert sorted(answer.status_code for answer in answers) == [429] * 5 + [504] * 3
            assert not it.bridge.field_limits._in_flight

    run(domain, test())
