"""Computed answers: shared, cancelled with their last client, and small ones never wait."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import ExitStack, asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import httpx
import numpy as np
import pytest

from lupin_bridge.past import fields
from lupin_bridge.routes import status, writes
from lupin_bridge.routes.answers import PIECE_BYTES
from lupin_bridge.routes.state import AGES_HOLD_S
from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.connections import HttpConnection
from lupin_bridge.settings import Settings
from lupin_bridge.stream.state_json import StateJson
from lupin_twin.core.notes import Note, withdrawals
from lupin_twin.core.state import Observation, Pose
from lupin_twin.field.engine import FieldRequest, compute_field
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.field.grid import FieldGrid
from lupin_twin.ros.node import TwinNode
from lupin_twin.runtime.workers import LARGE_THREADS, ShouldStop, Workers
from tests.support import raw_http
from tests.support.inprocess import Running, running
from tests.support.maps import map_of
from tests.support.tls import certificate
from tests.support.waiting import PATIENCE_S, until
from tests.support.web import deaf_client

# And no machine is too busy for an answer.
EAGER = Limits(answers_per_s=10_000.0, concurrency=1_000, answer_timeout_s=60.0)


def field(sensor: str = "co2", cells: int = 4, suffix: str = "json") -> str:
    """The path of a field of that many cells a side, over 4 m."""
    query = {
        "sensor_type": sensor,
        "resolution": 4.0 / cells,
        "bbox_min_x": 0.0,
        "bbox_min_y": 0.0,
        "bbox_max_x": 4.0,
        "bbox_max_y": 4.0,
    }
    return f"/api/field.{suffix}?{urlencode(query)}"


# A million cells, and 20 tags that reach all of them.
LARGE = 1_000


@asynccontextmanager
async def greenhouse(limits: Limits = EAGER) -> AsyncIterator[Running]:
    """A bridge whose twin knows 20 tags."""
    async with running(limits) as it:

        def fill(node: TwinNode) -> None:
            for number in range(20):
                pose = Pose(2.0 + number / 100, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0)
                names = ("co2", *(f"co2 {n}" for n in range(60)))
                values = dict.fromkeys(names, 400.0)
                node.store.record(Observation(str(number), 1_000_000_000, values, pose))

        await it.in_ros_thread(fill)
        await until(
            lambda: it.bridge.latest is not None and len(it.bridge.latest.snapshot.tags) == 20,
            "the tags",
        )
        yield it


class Held:
    """Computations of large fields that wait at a gate, or until they are cancelled."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.gate = threading.Event()
        self.begun: list[str] = []

        def held(request: FieldRequest, *others: Any) -> FieldGrid:
            self.begun.append(request.sensor_type)
            should_stop: ShouldStop = others[-1]
            while request.resolution < 0.1 and not should_stop():
                if self.gate.wait(0.01):
                    break
            return compute_field(request, *others)

        monkeypatch.setattr(fields, "compute_field", held)


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> Held:
    return Held(monkeypatch)


def fields_at(workers: Workers) -> tuple[int, int]:
    """How many fields wait, and how many are computed."""
    running = sum(job.running() for job in tuple(workers.jobs))
    return len(workers.jobs) - running, running


def send(it: Running, *paths: str) -> list[asyncio.Task[httpx.Response]]:
    return [asyncio.create_task(it.http.get(path)) for path in paths]


async def test_a_flood_of_the_most_expensive_fields_delays_no_tiny_one_nor_that_of_another_client(
    domain: int, held: Held
) -> None:
    other = httpx.AsyncHTTPTransport(local_address="127.0.0.2")
    async with greenhouse() as it:
        flood = send(it, *(field(f"co2 {n}", LARGE) for n in range(40)))
        # Half of the 24 places are for large ones; the other half is for others.
        await until(lambda: len(held.begun) == LARGE_THREADS, "work")
        await until(lambda: sum(task.done() for task in flood) == 28, "the refusals")
        refused = [task for task in flood if task.done()]
        tiny = await it.http.get(field("co2 50"))
        assert tiny.status_code == 200
        assert len(held.begun) == LARGE_THREADS + 1, "it passed them all"
        assert len(refused) == 28
        for task in refused:
            answer = await task
            assert (answer.status_code, answer.headers["retry-after"]) == (503, "1")
            text = "12 answers are being computed, 12 of them for 127.0.0.1"
            assert text in answer.json()["detail"]
        async with httpx.AsyncClient(transport=other, timeout=PATIENCE_S) as client:
            theirs = asyncio.create_task(client.get(it.url + field("co2 51", LARGE)))
            in_flight = it.bridge.admission.in_flight
            await until(lambda: in_flight["127.0.0.2"] == 1, "the other client's")
            held.gate.set()
            assert (await theirs).status_code == 200
        assert sorted([(await task).status_code for task in flood]) == [200] * 12 + [503] * 28
        assert held.begun.index("co2 51") < len(held.begun) - 2, "it passed the flood"


async def test_a_client_that_disconnects_cancels_its_work(domain: int, held: Held) -> None:
    async with greenhouse() as it:
        paths = [field(f"co2 {n}", LARGE) for n in range(6)]
        leaving = send(it, *paths)
        workers = it.bridge.source.workers
        await until(lambda: len(held.begun) == LARGE_THREADS, "work")
        await until(lambda: fields_at(workers)[0] >= 6 - LARGE_THREADS, "the rest behind it")
        at_work = list(held.begun)
        (staying,) = send(it, field(at_work[0], LARGE))
        await until(lambda: it.bridge.admission.in_flight["127.0.0.1"] == 7, "who stays")
        for task in leaving:
            task.cancel()
        await until(lambda: fields_at(workers) == (0, 1), "the others' end")
        held.gate.set()
        assert (await staying).status_code == 200
        # A freed thread may have started another one before that was cancelled too.
        assert held.begun.count(at_work[0]) == 1, "computed once, for who stayed"


async def test_a_malformed_body_has_one_answer_and_fills_no_log(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    async with greenhouse() as it:
        reader, writer = await asyncio.open_connection(*it.url.removeprefix("http://").split(":"))
        head = b"POST /api/notes HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
        writer.write(head + b"no chunk\r\n")  # at once: else the head alone is refused
        answer = await reader.read()
        writer.close()
        assert (answer[:12], answer.count(b"HTTP/1.1")) == (b"HTTP/1.1 400", 1)
        await until(lambda: not it.server.server_state.tasks, "the end of the request")
    assert [record for record in caplog.records if record.levelname == "ERROR"] == []


async def test_a_time_out_cancels_the_work_too(
    domain: int, held: Held, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Long enough for all four to run or wait by then.
    limits = Limits(answers_per_s=10_000.0, answer_timeout_s=3.0)
    async with greenhouse(limits) as it:
        answers = await asyncio.gather(*send(it, *(field(f"co2 {n}", LARGE) for n in range(4))))
        assert [answer.status_code for answer in answers] == [504] * 4
        assert "3 s" in answers[0].json()["detail"]
        workers = it.bridge.source.workers
        await until(lambda: fields_at(workers) == (0, 0), "the end of it all")
        assert it.bridge.admission.being_computed == 0
        # Notes that were never read, and a log that hangs.
        monkeypatch.setattr(type(it.bridge.notes), "notes", None)
        monkeypatch.setattr(it.bridge.notes, "look", lambda: asyncio.sleep(PATIENCE_S))
        assert (await it.http.get("/api/notes")).status_code == 504


async def test_a_long_list_of_notes_delays_no_other_answer(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate, was_open = threading.Event(), []

    def held(notes: tuple[Note, ...]) -> dict[str, Note]:
        was_open.append(gate.wait(5.0))
        return withdrawals(notes)

    monkeypatch.setattr(writes, "withdrawals", held)
    async with greenhouse() as it:
        (listed,) = send(it, "/api/notes")
        await until(lambda: it.bridge.admission.in_flight["127.0.0.1"] == 1, "the list's start")
        assert (await it.http.get("/healthz")).status_code == 200
        gate.set()
        assert (await listed).json() == {"notes": []}
    assert was_open == [True]


async def test_identical_requests_take_one_place_and_one_computation(
    domain: int, held: Held
) -> None:
    async with greenhouse() as it:
        requested = send(it, *[field("co2", LARGE)] * 6, field("co2", LARGE, "npy"))
        await until(lambda: it.bridge.admission.in_flight["127.0.0.1"] == 7, "all of them")
        await until(lambda: it.bridge.admission.being_computed == 2, "a body each")
        served = [c for c in it.server.server_state.connections if isinstance(c, HttpConnection)]
        assert [c.waiting_since_s for c in served] == [None] * 7, "and nobody makes room for others"
        held.gate.set()
        answers = await asyncio.gather(*requested)
        assert {answer.status_code for answer in answers} == {200}
        assert held.begun == ["co2"] * 2, "and a field each"


def count(monkeypatch: pytest.MonkeyPatch, where: Any, name: str) -> list[int]:
    """Count the calls of a function, which works as before."""
    calls: list[int] = []
    plain: Callable[..., Any] = getattr(where, name)

    def counted(*args: Any, **named: Any) -> Any:
        calls.append(1)
        return plain(*args, **named)

    monkeypatch.setattr(where, name, counted)
    return calls


async def test_the_state_is_serialised_a_few_times_a_second_and_is_never_old(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = count(monkeypatch, StateJson, "state")
    async with greenhouse() as it:
        loop = asyncio.get_running_loop()
        written.clear()
        began_s, before = loop.time(), it.bridge.state_number
        for _ in range(20):
            await asyncio.gather(*send(it, *["/api/state"] * 10))
        states = it.bridge.state_number - before + 1
        most = states + (loop.time() - began_s) / AGES_HOLD_S + 1
        # Plus the frames' own writes of each state.
        assert len(written) <= most + states
        pose = Pose(1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        new = Observation("new", 1, {}, pose)

        await it.in_ros_thread(lambda node: node.store.record(new))
        await until(lambda: len(it.bridge.latest.snapshot.tags) == 21, "the new tag")  # type: ignore[union-attr]
        assert "new" in (await it.http.get("/api/state")).text
        assert len(it.bridge.cache) == 1, "those before, which nobody reads any more, made place"


def large_map() -> OccupancyMap:
    """4 million cells of noise, whose picture takes some 3 MB."""
    side = 2_000
    cells = np.random.default_rng(1).integers(-1, 101, (side, side), dtype=np.int8)
    return map_of(cells, resolution=0.05)


async def test_a_hundred_readers_that_do_not_read_a_map_hold_one_picture_and_two_pieces_each(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = count(monkeypatch, status, "map_png")
    async with greenhouse() as it:
        stack, occupancy = ExitStack(), large_map()
        monkeypatch.setattr(it.twin, "occupancy_map", lambda: occupancy)
        size = len((await it.http.get("/api/map.png")).content)
        assert size > 2_000_000
        for _ in range(100):
            stack.enter_context(deaf_client(it.url, "/api/map.png"))
        server = it.server.server_state.connections
        await until(
            lambda: sum(c.transport.get_write_buffer_size() > 0 for c in server) == 100,
            "sockets that are full",
        )
        assert len(drawn) == 1
        unsent = [connection.transport.get_write_buffer_size() for connection in server]
        assert max(unsent) <= 2 * PIECE_BYTES, "one at the socket, one behind it"
        tiny = await asyncio.wait_for(it.http.get(field("co2 7")), PATIENCE_S)
        assert tiny.status_code == 200
        stack.close()


async def test_over_tls_nothing_more_is_buffered_for_a_reader_that_does_not_read(
    domain: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    ours, occupancy = certificate(tmp_path), large_map()
    settings = Settings(tls_cert=str(ours.cert), tls_key=str(ours.key))
    async with running(settings=settings) as it:
        monkeypatch.setattr(it.twin, "occupancy_map", lambda: occupancy)
        with raw_http.connect(it.url, room=4_096) as plain:
            wrap = partial(ours.trust.wrap_socket, plain, server_hostname="127.0.0.1")
            with await asyncio.to_thread(wrap) as deaf:
                deaf.sendall(b"GET /api/map.png HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
                [reader] = it.server.server_state.connections
                assert isinstance(reader, HttpConnection)
                await until(lambda: reader.flow.write_paused, "a socket that is full")
                assert reader.transport.get_write_buffer_size() <= 2 * PIECE_BYTES
