"""History, timeline, and answers as of a moment over HTTP, over a made-up past."""

import asyncio
import math
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import orjson
import pytest

from lupin_bridge.app import document
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.query import PastQuery
from lupin_bridge.feed.source import TwinTimeoutError, TwinUnavailableError
from lupin_bridge.judge.quantities import DERIVED
from lupin_bridge.past import fields, plans
from lupin_bridge.serving.admission import Limits
from lupin_bridge.stream import routes_schema, schema
from lupin_twin.core.past import (
    Event,
    NotFound,
    NotRemembered,
    PastRefused,
    SeriesPast,
    SeriesRequest,
    grid,
)
from lupin_twin.core.state import Pose, Reading, Snapshot, TagState
from lupin_twin.field import engine
from tests.support.inprocess import Running, running
from tests.support.past import NS, MadeUp, look_up
from tests.support.people import OWN
from tests.support.waiting import PATIENCE_S, until

HISTORY = "/api/history?tag_id=7&sensor_type=co2"


@asynccontextmanager
async def remembering(past: MadeUp, limits: Limits | None = None) -> AsyncIterator[Running]:
    async with running(limits) as it:
        twin = it.twin
        twin.rows = past.rows  # type: ignore[method-assign]

        async def send(query: PastQuery[Any], cost_s: float) -> Any:
            past.costs.append(cost_s)
            return await look_up(query, past, twin.workers)

        twin.ask = send  # type: ignore[method-assign]
        await until(lambda: it.bridge.latest is not None, "the first state")
        yield it


async def test_a_history_has_readings_or_buckets_where_there_are_too_many(domain: int) -> None:
    points = [(number * NS, float(number)) for number in range(100)]
    points[10:12] = [(10 * NS + 1, math.nan), (11 * NS, math.inf)]
    async with remembering(MadeUp(points={("7", "co2"): points})) as it:
        answer = await it.http.get(f"{HISTORY}&from=10&to=1970-01-01T00:00:20Z")
        found = routes_schema.History.model_validate_json(answer.content)
        values = [None, None, *map(float, range(12, 20))]
        assert [reading.value for reading in found.readings] == values
        assert found.readings[0].stamp.model_dump() == {"sec": 10, "nanosec": 1}
        assert (found.tag_id, found.sensor_type, found.unit) == ("7", "co2", "ppm")
        assert (found.from_.sec, found.to.sec) == (10, 20)
        answer = await it.http.get(f"{HISTORY}&from=20&to=30&points=5")
        found = routes_schema.History.model_validate_json(answer.content)
        assert (found.is_bucketed, found.bucket_s, len(found.buckets)) == (True, 2.0, 5)
        assert found.buckets[0].model_dump() == {
            "start": {"sec": 20, "nanosec": 0},
            "n": 2,
            "mean": 20.5,
            "min": 20.0,
            "max": 21.0,
        }


async def test_a_simulations_nights_are_those_of_its_light_not_of_the_clock(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    period = "from=2026-11-27T00:00:00Z&to=2026-11-28T00:00:00Z"
    begin_s = 1_795_737_600
    async with remembering(MadeUp()) as it:
        assert len((await it.http.get(f"{HISTORY}&{period}")).json()["nights"]) == 2
        monkeypatch.setattr(Bridge, "origin", "simulated")
        assert (await it.http.get(f"{HISTORY}&{period}")).json()["nights"] is None
    lux = [9_000.0, 20.0, math.nan, 0.0, 800.0, 70_000.0, 10.0]
    points = [((begin_s + 600 * index) * NS, lx) for index, lx in enumerate(lux)]
    async with remembering(MadeUp(points={("7", "light"): points})) as it:
        nights = (await it.http.get(f"{HISTORY}&{period}")).json()["nights"]
        seconds = [night[end]["sec"] - begin_s for night in nights for end in ("from", "to")]
        assert seconds == [600, 2_400, 3_600, 86_400]


async def test_a_timeline_queries_every_event_of_one_period(domain: int) -> None:
    past = MadeUp(points={("*", "~scans"): [(NS, 5.0), (2 * NS, 5.0)], ("*", "~runs"): [(0, 9.0)]})
    past.points["7", "~scans"] = [(NS, 5.0)]
    for event, seconds in ((Event.FAILURES, 3), (Event.PESTS_SEEN, 55), (Event.PESTS_CLEARED, 950)):
        past.points["*", event] = [(seconds * NS, 1.0)]
    past.points["*", Event.INSPECTIONS] = [(at * NS, 1.0) for at in (55, 56, 950)]
    async with remembering(past) as it:
        answer = await it.http.get("/api/timeline?points=10")
        found = routes_schema.Timeline.model_validate_json(answer.content)
        assert [bucket.model_dump(exclude={"start"}) for bucket in found.buckets] == [
            {"scans": 2, "failures": 1, "looks": 2, "pests_seen": 1, "pests_cleared": 0},
            {"scans": 0, "failures": 0, "looks": 1, "pests_seen": 0, "pests_cleared": 1},
        ]
        assert [bucket.start.sec for bucket in found.buckets] == [0, 900]
        assert (found.bucket_s, found.reach is None, len(found.runs)) == (100.0, False, 1)
        requested = [request for request in past.requested if isinstance(request, SeriesRequest)]
        assert {request.sensor_type for request in requested} == set(Event)
        assert {request.tag_id for request in requested} == {"*"}
        # The first query reads the time; all others use it.
        assert [request.end_ns for request in requested] == [0, *[past.now_ns] * 6]
        answer = await it.http.get("/api/timeline?points=10&tag_id=7")
        found = routes_schema.Timeline.model_validate_json(answer.content)
        assert [b.scans for b in found.buckets] == [1]


async def test_events_in_five_minute_buckets_share_a_grid_with_single_events(domain: int) -> None:
    """Scans too many to be read one by one, beside few failures, in buckets of seconds."""
    slot_ns = 300 * NS
    failures = ("*", Event.FAILURES)
    # One is in the first five minutes, before the start of the period.
    past = MadeUp(points={failures: [(310 * NS, 1.0), (420 * NS, 1.0), (899 * NS, 1.0)]})

    def series(request: SeriesRequest) -> SeriesPast:
        if request.event is not Event.SCANS:
            return MadeUp.series(past, request)
        reported = grid(request.start_ns, request.end_ns, request.max_points, slot_ns)
        found = (20_000.0,) * 2
        stamps = (slot_ns, 2 * slot_ns)
        edges = reported.start_ns, reported.end_ns, reported.bucket_ns
        return SeriesPast(*edges, stamps, (20_000,) * 2, found, found, found)

    async with remembering(past) as it:
        past.series = series  # type: ignore[method-assign]
        answer = await it.http.get("/api/timeline?from=400&to=700&points=100")
        found = routes_schema.Timeline.model_validate_json(answer.content)
        assert (found.from_.sec, found.to.sec, found.bucket_s) == (300, 900, 300.0)
        assert [(b.start.sec, b.scans, b.failures) for b in found.buckets] == [
            (300, 20_000, 2),
            (600, 20_000, 1),
        ]


@pytest.mark.parametrize(
    ("error", "status", "retry_after"),
    [
        (PastRefused("points is 7, the limit is 6"), 400, None),
        (NotFound("nobody counts it here"), 404, None),
        (NotRemembered("the disk is away"), 503, "3"),
        (TwinTimeoutError("it took too long"), 504, None),
        (TwinUnavailableError("nobody is there"), 503, "3"),
    ],
)
async def test_an_error_of_the_source_is_reported(
    domain: int, error: Exception, status: int, retry_after: str | None
) -> None:
    async with remembering(MadeUp(error=error)) as it:
        for path in (HISTORY, "/api/timeline", "/api/report.html", "/api/export.csv"):
            answer = await it.http.get(path)
            assert (answer.status_code, answer.json()) == (status, {"detail": str(error)})
            assert answer.headers.get("retry-after") == retry_after
        assert it.bridge.admission.being_computed == len(it.bridge.admission.exports) == 0


async def test_a_client_that_disconnects_cancels_its_query(domain: int) -> None:
    ended = asyncio.Event()

    async def for_ever(*_: Any) -> Any:
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

    async with remembering(MadeUp()) as it:
        it.twin.ask = for_ever  # type: ignore[method-assign, assignment]
        for path in (HISTORY, "/api/state?at=9"):
            ended.clear()
            asking = asyncio.create_task(it.http.get(path))
            await until(lambda: it.bridge.admission.being_computed == 1, "the query")
            asking.cancel()
            await until(ended.is_set, "its end")
            await until(lambda: it.bridge.admission.being_computed == 0, "its place")


async def test_queries_declare_their_cost_and_are_timed_by_their_kind(domain: int) -> None:
    past = MadeUp()
    async with remembering(past) as it:
        for path in (HISTORY, "/api/timeline", "/api/timeline?to=5"):
            assert (await it.http.get(path)).status_code == 200
        assert min(past.costs) > 0, "by which a dear one gives way to a cheap one"
        text = (await it.http.get("/metrics")).text
        assert 'lupin_past_seconds_count{question="history"} 1.0' in text
        assert 'lupin_past_seconds_count{question="timeline"} 2.0' in text


FIELD = "sensor_type=co2&resolution=0.5"
PATHS = (
    "/api/state?",
    "/api/tags/a%2Fb?",
    f"/api/field?{FIELD}",
    f"/api/field.json?{FIELD}",
    f"/api/field.png?{FIELD}&scale=2",
    f"/api/field.npy?{FIELD}",
    f"/api/field/quality?{FIELD}",
    "/api/health?",
)


def greenhouse(value: float = 400.0) -> Snapshot:
    pose = Pose(1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    return Snapshot(0, "map", (TagState("a/b", pose, (Reading("co2", value, NS),), NS),))


async def test_every_route_answers_as_of_a_moment(domain: int) -> None:
    past = MadeUp(snapshot=greenhouse())
    async with remembering(past) as it:
        state = schema.TwinState.model_validate_json(
            (await it.http.get("/api/state?at=1970-01-01T00:00:09.5Z")).content
        )
        assert (state.header.stamp.sec, state.header.stamp.nanosec) == (9, 500_000_000)
        assert [tag.stale_seconds for tag in state.tags] == [8.5]
        tag = schema.TwinTagState.model_validate_json(
            (await it.http.get("/api/tags/a%2Fb?at=9.5")).content
        )
        assert tag == state.tags[0]
        for path in PATHS[2:4]:
            field = schema.GetFieldResponse.model_validate_json(
                (await it.http.get(f"{path}&at=9")).content
            )
            assert (field.sample_count, field.value_max) == (1, 400.0)
            assert (field.origin_x, field.origin_y) == (-0.5, 0.5), "the box of then"
        assert (await it.http.get(f"{PATHS[4]}&at=9")).content[:4] == b"\x89PNG"
        assert (await it.http.get(f"{PATHS[5]}&at=9")).content[:6] == b"\x93NUMPY"
        quality = (await it.http.get(f"{PATHS[6]}&at=9")).json()
        assert quality["sample_count"] == 1
        health = schema.Judgement.model_validate_json(
            (await it.http.get("/api/health?at=9")).content
        )
        assert (health.house.verdict, health.tags["a/b"].verdict) == ("healthy", "healthy")
        assert set(past.requested) == {9 * NS, 19 * NS // 2}
        answer = await it.http.get("/api/tags/c?at=9")
        assert answer.status_code == 404
        # Before the start of the log, nothing is known.
        assert "no tag 'c' is known (1 others are); what was received" in answer.text
        air = (Reading("temperature", 25.0, NS), Reading("humidity", 60.0, NS))
        past.snapshot = Snapshot(0, "map", (TagState("a/b", None, air, NS),))
        [tag] = (await it.http.get("/api/state?at=8")).json()["tags"]
        assert tag["derived"] == pytest.approx(
            {name: it.formula(25.0, 60.0) for name, it in DERIVED.items()}, abs=5e-5
        )
        assert (await it.http.get("/api/tags/a%2Fb?at=8")).json() == tag


async def test_a_daily_quantity_is_queried_like_a_sensor(domain: int) -> None:
    hour_ns = 3600 * NS
    points = [(n * hour_ns, 54_000.0) for n in range(1, 40)]
    state = greenhouse()
    lit = replace(state.tags[0], readings=(Reading("light", 54_000.0, 39 * hour_ns),))
    past = MadeUp(
        points={("a/b", "light"): points}, snapshot=replace(state, tags=(lit,)), now_ns=40 * hour_ns
    )
    async with remembering(past) as it:
        path = "/api/field.json?sensor_type=daily_light_integral&resolution=0.5"
        found = (await it.http.get(f"{path}&at={39 * 3600}")).json()
        # 24 h of 1000 umol/m2/s.
        assert (found["sample_count"], found["value_max"]) == (1, pytest.approx(86.4))
        now = (await it.http.get(path)).json()
        assert now["ok"]
        requested = "tag_id=a%2Fb&sensor_type=daily_light_integral"
        history = (await it.http.get(f"/api/history?{requested}&from=108000&to=144000")).json()
        assert history["unit"] == "mol/m²/d"
        assert [it["value"] for it in history["readings"]] == [pytest.approx(86.4)] * 10


async def test_a_matching_etag_gets_304_and_nothing_is_written(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    past = MadeUp(snapshot=greenhouse())

    def none(*_: Any, **__: Any) -> Any:
        raise AssertionError("written")

    async with remembering(past) as it:
        tags = {}
        for path in PATHS:
            answer = await it.http.get(f"{path}&at=9")
            assert (answer.status_code, answer.headers["cache-control"]) == (200, "no-cache")
            tags[path] = answer.headers["etag"]
        it.bridge.cache.__init__()  # type: ignore[misc]
        with monkeypatch.context() as patch:
            patch.setattr(fields, "compute_field", none)
            patch.setattr(plans, "StateJson", none)
            for path, tag in tags.items():
                has = {"If-None-Match": tag}
                answer = await it.http.get(f"{path}&at=9", headers=has)
                assert (answer.status_code, answer.content) == (304, b"")
                assert answer.headers["etag"] == tag
        past.snapshot = greenhouse(1600.0)  # observed before, received late
        for path, tag in tags.items():
            answer = await it.http.get(f"{path}&at=9", headers={"If-None-Match": tag})
            assert answer.status_code == 200
            assert answer.headers["etag"] != tag


async def test_an_answer_that_took_long_is_not_written_again(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    computed = []
    compute = engine.compute_field

    def counted(*args: Any) -> Any:
        computed.append(args)
        return compute(*args)

    monkeypatch.setattr(fields, "compute_field", counted)
    async with remembering(MadeUp(snapshot=greenhouse())) as it:
        path = "/api/field?sensor_type=co2&resolution=0.4"
        for long_s, times in ((0.0, 1), (60.0, 4)):
            monkeypatch.setattr(plans, "KEPT_IF_S", long_s)
            computed.clear()
            # No scan in between: it is the same field.
            bodies = {(await it.http.get(f"{path}&at={at}")).content for at in (9, 9, 9.5, 10)}
            assert (len(bodies), len(computed)) == (1, times)
            path = path.replace("0.4", "0.3")


async def test_simultaneous_equal_queries_run_once(domain: int) -> None:
    past = MadeUp(snapshot=greenhouse())
    gate = threading.Event()

    def held(at_ns: int) -> Snapshot:
        past.requested.append(at_ns)
        gate.wait(PATIENCE_S)
        return past.snapshot

    async with remembering(past) as it:
        past.state = held  # type: ignore[method-assign]
        number = it.bridge.state_number
        asking = [asyncio.create_task(it.http.get(f"{PATHS[0]}&at=9")) for _ in range(5)]
        in_flight = it.bridge.admission.in_flight
        await until(lambda: in_flight["127.0.0.1"] == 5, "all of them")
        gate.set()
        assert {(await task).status_code for task in asking} == {200}
        # One more for each state since: it may have changed the past.
        assert len(past.requested) <= 1 + it.bridge.state_number - number


INVALID = (
    ("/api/history", "tag_id: field required"),
    (f"{HISTORY}&points=0", "points is '0'"),
    (f"{HISTORY}&from=2000-01-01T00:00:00", "from is '2000-01-01T00:00:00', expected"),
    (f"{HISTORY}&from=2147483647", "later than now"),
    ("/api/export.csv?to=1&to=1", "to is given more than once"),
    ("/api/field?sensor_type=co2&resolution=0&at=9", "resolution"),
)
INVALID_MOMENTS = (
    ("2147483647", "at is 2147483647.000000000 s, later than now, "),
    ("yesterday", "at is 'yesterday', expected ROS seconds"),
    ("9&at=9", "at is given more than once"),
    ("9&when=9", "parameter 'when' is unknown"),
)


async def test_every_route_refuses_an_unknown_parameter(domain: int) -> None:
    async with remembering(MadeUp(snapshot=greenhouse())) as it:
        for path, methods in orjson.loads(document())["paths"].items():
            for method in methods if path.startswith("/api/") else ():
                answer = await it.http.request(method, f"{path}?tag=1", headers=OWN)
                assert answer.status_code == 400, path
                assert "parameter 'tag' is unknown, expected " in answer.text, path


async def test_an_invalid_query_is_refused_before_any_work(domain: int) -> None:
    past = MadeUp(snapshot=greenhouse())
    moments = [(f"{path}&at={at}", part) for path in PATHS for at, part in INVALID_MOMENTS]
    async with remembering(past) as it:
        for path, part in (*INVALID, *moments):
            answer = await it.http.get(path)
            assert answer.status_code == 400
            assert part in answer.json()["error_message" if "field" in path else "detail"]
        assert past.requested == []
