"""State, tag, field, quality and health as of a moment, over HTTP."""

import asyncio
import threading
from dataclasses import replace
from typing import Any

import pytest

from lupin_bridge.past import fields, plans
from lupin_bridge.stream import schema
from lupin_twin.core.state import Pose, Reading, Snapshot, TagState
from lupin_twin.field import engine
from tests.bridge.routes.test_past import remembering
from tests.support.past import NS, MadeUp
from tests.support.waiting import PATIENCE_S, until

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


async def test_a_written_answer_is_cached(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    computed = []
    compute = engine.compute_field

    def counted(*args: Any) -> Any:
        computed.append(args)
        return compute(*args)

    monkeypatch.setattr(fields, "compute_field", counted)
    async with remembering(MadeUp(snapshot=greenhouse())) as it:
        path = f"/api/field?{FIELD}"
        # No scan in between: it is the same field.
        bodies = {(await it.http.get(f"{path}&at={at}")).content for at in (9, 9, 9.5, 10)}
        assert (len(bodies), len(computed)) == (1, 1)
        assert (await it.http.get(f"{path}&at=9&resolution=0.5")).status_code == 400


async def test_simultaneous_equal_queries_run_once(domain: int) -> None:
    past = MadeUp(snapshot=greenhouse())
    gate = threading.Event()

    def held(at_ns: int) -> Snapshot:
        past.requested.append(at_ns)
        gate.wait(PATIENCE_S)
        return past.snapshot

    async with remembering(past) as it:
        past.state_at = held  # type: ignore[method-assign]
        number = it.bridge.state_number
        asking = [asyncio.create_task(it.http.get(f"{PATHS[0]}&at=9")) for _ in range(5)]
        in_flight = it.bridge.admission.in_flight
        await until(lambda: in_flight["127.0.0.1"] == 5, "all of them")
        gate.set()
        assert {(await task).status_code for task in asking} == {200}
        # One more for each state since: it may have changed the past.
        assert len(past.requested) <= 1 + it.bridge.state_number - number


async def test_the_future_and_invalid_moments_are_refused_before_any_work(domain: int) -> None:
    past = MadeUp(snapshot=greenhouse())
    async with remembering(past) as it:
        for path in PATHS:
            for at, part in (
                ("2147483647", "at is 2147483647.000000000 s, later than now, "),
                ("yesterday", "at is 'yesterday', expected ROS seconds"),
                ("9&at=9", "at is given more than once"),
                ("9&when=9", "parameter 'when' is unknown"),
            ):
                answer = await it.http.get(f"{path}&at={at}")
                assert answer.status_code == 400
                name = "error_message" if "field" in path else "detail"
                assert part in answer.json()[name]
        answer = await it.http.get("/api/field?sensor_type=co2&resolution=0&at=9")
        assert "resolution" in answer.json()["error_message"]
        assert past.requested == []
