"""Limits of computed answers, rate limits of clients, and the cache of serialised answers."""

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from typing import Any

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.serving.admission import (
    BURST_S,
    ENTRY_BYTES,
    EXPORTS,
    LONG_EXPORT_S,
    Admission,
    Answer,
    AnswerCache,
    BusyError,
    ClientLimitError,
    Limits,
    RateLimit,
    client_key,
)
from lupin_bridge.stream import schema
from tests.support.access import Served, served
from tests.support.inprocess import running
from tests.support.processes import limits

ROUTES = ("/api/field", "/api/field.json", "/api/field.png", "/api/field.npy", "/api/field/quality")
QUERY = "?sensor_type=co2&resolution=1&bbox_min_x=0&bbox_min_y=0&bbox_max_x=4&bbox_max_y=4"
HISTORY, EXPORT = "/api/history?tag_id=1&sensor_type=co2", "/api/export.csv?from=1&to=5"
COMPUTED = ("/api/state", HISTORY, EXPORT, "/metrics", "/openapi.json")


def admitted(rate_hz: float, seconds: float) -> int:
    """How many evenly spaced requests of a client are admitted, by the default limits."""
    limits = Limits()
    admission = Admission(limits)
    count = 0
    for number in range(round(rate_hz * seconds)):
        with suppress(ClientLimitError), admission.request("page", number / rate_hz):
            count += 1
    return count


def test_dragging_through_the_past_is_admitted_and_a_flood_is_not() -> None:
    moments_hz, seconds = 10.0, 60.0
    # A state, a field, and the field to compare.
    assert admitted(3 * moments_hz, seconds) == 3 * moments_hz * seconds
    allowed = Limits().answers_per_s * (seconds + BURST_S)
    assert admitted(1_000.0, seconds) == pytest.approx(allowed, abs=1)


def test_the_oldest_export_is_ended_for_another_client_and_frees_one_place() -> None:
    admission, ended = Admission(Limits()), list[str]()
    with ExitStack() as taken:

        def begin(client: str, now_s: float) -> None:
            taken.enter_context(admission.export(client, now_s, lambda: ended.append(client)))

        for at_s, client in enumerate("abcd"):
            begin(client, at_s)
        with pytest.raises(BusyError):
            begin("e", LONG_EXPORT_S - 1)
        with pytest.raises(ClientLimitError):
            begin("c", LONG_EXPORT_S)
        begin("e", LONG_EXPORT_S)
        assert ended == ["a"]
        assert admission.refused == {"client_exports": 1, "total_exports": 1}
        assert len(admission.exports) == EXPORTS
    assert len(admission.exports) == 0
    admission = Admission(Limits())
    with ExitStack() as taken, ExitStack() as broken_off:
        for client, stack in zip("abcdea", (broken_off, *[taken] * 5), strict=True):
            now_s = LONG_EXPORT_S * len(admission.exports)
            stack.enter_context(admission.export(client, now_s, lambda: None))
        broken_off.close()
        assert len(admission.exports) == EXPORTS


def test_a_client_has_a_rate_and_a_request_refused_for_its_number_uses_no_turn() -> None:
    admission = Admission(Limits(answers_per_s=0.5, concurrency=9, total_concurrency=9))
    with admission.request("a", 0.0):
        pass
    with pytest.raises(ClientLimitError) as refused, admission.request("a", 0.25):
        pytest.fail("let in")
    assert str(refused.value) == "a requests more than 0.5 computed answers a second, the limit"
    assert refused.value.retry_after_s == pytest.approx(1.75)
    assert refused.value.headers == {"Retry-After": "2"}
    with admission.request("b", 0.25), admission.request("a", 2.0):
        pass
    admission = Admission(Limits(answers_per_s=1.0, concurrency=1, total_concurrency=9))
    with admission.request("a", 0.0):
        for _ in range(100):
            with pytest.raises(ClientLimitError, match="in flight"), admission.request("a", 0.0):
                pytest.fail("let in")
    with admission.request("a", 0.0):
        pass


@pytest.mark.parametrize("total", [1, 2, 3])
def test_large_computations_have_few_places(total: int) -> None:
    admission = Admission(Limits(answers_per_s=1.0, concurrency=1, total_concurrency=total))
    with ExitStack() as taken:
        for client in range(total):
            taken.enter_context(admission.computing(str(client), is_large=True))


@pytest.mark.parametrize("is_large", [False, True])
def test_six_clients_at_their_limit_each_get_a_place(is_large: bool) -> None:
    limits = Limits()
    admission = Admission(limits)
    places: Counter[str] = Counter()
    with ExitStack() as taken:
        for client in "abcdef":
            for _ in range(limits.concurrency):
                with suppress(BusyError):
                    taken.enter_context(admission.computing(client, is_large=is_large))
                    places[client] += 1
        assert places["a"] == limits.concurrency, "who is alone has all that he may have"
        assert admission.refused.keys() == {"large_in_flight" if is_large else "total_in_flight"}
        assert min(places[client] for client in "abcdef") >= 1
    assert admission.being_computed == 0


RATE_HZ = 0.01


@pytest.fixture(scope="module")
def slow() -> Iterator[Served]:
    with served(*limits(answers_per_s=RATE_HZ)) as running_bridge:
        yield running_bridge


@pytest.mark.parametrize("route", ROUTES)
def test_every_field_route_has_the_limit(slow: Served, route: str) -> None:
    with slow.client(address=f"127.0.1.{ROUTES.index(route) + 1}") as client:
        query = QUERY.replace("co2", route)
        first = client.get(route + query)
        assert first.status_code == 200
        assert client.get(route + query).content == first.content, "a cached answer costs nothing"
        second = client.get(route + QUERY.replace("co2", f"other {route}"))
        refusal = schema.GetFieldResponse.model_validate_json(second.content)
        assert (refusal.ok, refusal.values, refusal.width) == (False, [], 0)
        assert refusal.sample_count == 0
        assert_slowed(second, refusal.error_message)
        with slow.client() as other:
            assert other.get(route + query).status_code == 200, "another client"


def assert_slowed(answer: httpx.Response, why: str) -> None:
    assert answer.status_code == 429
    assert 1 <= int(answer.headers["retry-after"]) <= 1 / RATE_HZ
    assert f"requests more than {RATE_HZ} computed answers a second, the limit" in why


def test_routes_without_computation_use_no_turn(slow: Served) -> None:
    with slow.client(address="127.0.2.1") as client:
        for _ in range(5):
            assert client.get("/api/field?sensor_type=co2&resolution=-1").status_code == 400
        tag = client.get("/api/field" + QUERY).headers["etag"]
        for _ in range(5):
            known = client.get("/api/field" + QUERY, headers={"If-None-Match": tag})
            assert (known.status_code, known.content) == (304, b"")
        assert client.get("/api/field" + QUERY.replace("co2", "another")).status_code == 429


@pytest.mark.parametrize("route", COMPUTED)
def test_every_other_computed_answer_has_the_limit_too(slow: Served, route: str) -> None:
    address = f"127.0.4.{COMPUTED.index(route) + 1}"
    with slow.client(address=address) as client:
        assert client.get("/api/field.npy" + QUERY.replace("co2", address)).status_code == 200
        answer = client.get(route, headers={"Host": f"localhost:{COMPUTED.index(route) + 1}"})
        detail = schema.ErrorMessage.model_validate_json(answer.content).detail
        assert detail.startswith(address)
        assert_slowed(answer, detail)


async def test_with_all_places_taken_the_answer_is_503_until_one_is_free(domain: int) -> None:
    async with running(Limits(total_concurrency=2)) as it:
        with ExitStack() as taken:
            for client in "ab":
                taken.enter_context(it.bridge.admission.computing(client))
            busy = await it.http.get("/api/field" + QUERY)
            assert it.bridge.admission.refused == {"total_in_flight": 1}
            assert busy.status_code == 503
            assert (busy.headers["retry-after"], busy.headers["vary"]) == ("1", "Accept")
            assert "the limit is 2" in busy.json()["detail"]
            # No field was computed, so none was quick.
            assert "\nlupin_field_seconds_count 0.0\n" in (await it.http.get("/metrics")).text
            # Live and cheap answers take no place.
            for live in ("/api/state", "/api/health"):
                assert (await it.http.get(live)).status_code == 200
        free = await asyncio.gather(*(it.http.get("/api/field" + QUERY) for _ in range(2)))
        assert [answer.status_code for answer in free] == [200, 200]


def test_a_cached_answer_passes_the_limit(slow: Served) -> None:
    with slow.client(address="127.0.5.1") as client:
        assert [client.get("/openapi.json").status_code for _ in range(5)] == [200] * 5


def taken(limit: RateLimit, client: str, now_s: float, attempts: int) -> int:
    return sum(limit.take(client, now_s) == 0.0 for _ in range(attempts))


def test_a_burst_passes_at_once_the_next_turn_waits_and_several_are_taken_together() -> None:
    limit = RateLimit(rate_hz=20.0, burst=40.0)
    assert taken(limit, "a", 100.0, 60) == 40
    assert limit.take("a", 100.0) == pytest.approx(0.05)
    assert limit.wait_s("a", 100.04) == pytest.approx(0.01)
    assert taken(limit, "a", 100.05, 2) == 1
    assert taken(limit, "a", 3_600.0, 60) == 40
    assert taken(limit, "a", 3_600.0, 60) == 0, "a long rest saves up one burst and no more"
    limit = RateLimit(rate_hz=10.0, burst=5.0)
    assert limit.take("a", 0.0, 6) == pytest.approx(0.1), "or not at all"
    assert limit.take("a", 0.0, 5) == 0.0
    assert limit.take("a", 0.0) == pytest.approx(0.1)


def test_the_table_is_bounded_and_drops_the_least_recently_active() -> None:
    limit = RateLimit(rate_hz=0.001, burst=1.0, max_keys=3)
    for client in ("a", "b", "c", "d", "e"):
        assert limit.take(client, 0.0) == 0.0
    assert limit.take("a", 0.0) == 0.0, "it was forgotten"
    assert limit.take("e", 0.0) > 0.0, "it was not"
    limit = RateLimit(rate_hz=0.001, burst=2.0, max_keys=2)
    for client in ("a", "b", "a", "c"):
        limit.take(client, 0.0)
    assert limit.take("a", 0.0) > 0.0, "of b less was heard"


@pytest.mark.parametrize(
    ("address", "client"),
    [
        ("192.168.7.20", "192.168.7.20"),
        ("::ffff:192.168.7.20", "192.168.7.20"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2::1", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("::1", "::/64"),
        ("", ""),
        ("a unix socket", "a unix socket"),
    ],
)
def test_an_address_identifies_its_client(address: str, client: str) -> None:
    assert client_key(address) == client


def answer(size: int) -> Answer:
    return Answer(b"x" * size, "text/plain")


def cached(*bodies: int) -> AnswerCache:
    """Room for exactly these bodies."""
    return AnswerCache(max_bytes=sum(bodies) + len(bodies) * ENTRY_BYTES)


def has(stored: AnswerCache, key: object) -> bool:
    lent = stored.lend(key)
    if lent is not None:
        lent[1]()
    return lent is not None


def holds(stored: AnswerCache, key: object, expected: Answer) -> bool:
    lent = stored.lend(key)
    if lent is not None:
        lent[1]()
    return lent is not None and lent[0] is expected


def test_an_answer_being_sent_stays_and_counts_and_a_replacement_takes_its_place() -> None:
    stored = cached(10, 10)
    stored.put("a", answer(10))
    lent = [stored.lend("a"), stored.lend("a")]
    stored.put("b", answer(10))
    stored.put("c", answer(10))
    assert [has(stored, key) for key in "abc"] == [True, False, True]
    stored.put("d", answer(20 + ENTRY_BYTES))
    assert not has(stored, "d"), "there is no room while anybody reads"
    for one in lent:
        assert one is not None
        one[1]()
    stored.put("d", answer(20 + ENTRY_BYTES))
    assert [has(stored, key) for key in "abcd"] == [False, False, False, True]
    stored = cached(10, 10, 10)
    stored.put("field", answer(10))
    for number in range(100):
        stored.put(("state", number), answer(10), instead_of=("state", number - 1))
    assert has(stored, "field"), "the many states in between did not drive it out"
    stored.put("huge", answer(1_000_000))
    assert has(stored, "field"), "nor what there is no room for"
    assert len(stored) == 2


Step = tuple[str, int, int]
STEPS = st.lists(
    st.tuples(st.sampled_from(["put", "lend", "give back"]), st.integers(0, 5), st.integers(0, 40))
)


@given(STEPS)
def test_the_bound_always_holds(steps: list[Step]) -> None:
    stored = AnswerCache(max_bytes=60 + 3 * ENTRY_BYTES)
    lent: list[Any] = []
    for what, key, size in steps:
        if what == "put":
            stored.put(key, answer(size))
        elif what == "lend" and (one := stored.lend(key)) is not None:
            lent.append(one)
        elif what == "give back" and lent:
            lent.pop()[1]()
        assert 0 <= stored.bytes <= 60 + 3 * ENTRY_BYTES
        for one, _ in lent:
            assert any(holds(stored, key, one) for key in range(6))
    for _, give_back in lent:
        give_back()
    stored.put("all", answer(60 + 2 * ENTRY_BYTES))
    assert (len(stored), stored.bytes) == (1, 60 + 3 * ENTRY_BYTES), (
        "nobody holds anything any more"
    )
