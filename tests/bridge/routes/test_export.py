"""The export: as fast as its reader, within its limits, and never complete when it is not."""

import asyncio
import math
import sys
from collections import deque
from collections.abc import AsyncIterator
from contextlib import ExitStack

import httpx
import pyarrow
import pytest
from pyarrow import parquet

from lupin_bridge.bridge import Bridge
from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.past import bodies
from lupin_bridge.past.export import GROUP_ROWS
from lupin_bridge.serving import admission
from lupin_bridge.serving.admission import EXPORTS, Limits
from lupin_twin.core.past import PastRow
from tests.bridge.routes.test_past import remembering
from tests.support import raw_http
from tests.support.past import NS, MadeUp
from tests.support.waiting import until, until_answered
from tests.support.web import deaf_client

PATH = "/api/export.csv"
# Too many for a socket's buffers: 25 MB.
MANY = 300
# The most that a reader that does not read may cost: the buffers of one socket on both sides, and
# what waits behind it.
MOST_TAKEN_BYTES = 8_000_000


def rows(count: int, stamp_s: int = 1) -> list[PastRow]:
    return [PastRow(stamp_s * NS, "7", 1.0, 2.0, "co2", math.pi, 0, "robot")] * count


async def test_all_rows_come_under_one_header(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    past = MadeUp(lots=[rows(3), [], rows(2, 5)])
    async with remembering(past) as it:
        query = "from=1&to=9&tag_id=a/b&sensor_type=co2"
        answer = await it.http.get(f"{PATH}?{query}")
        assert answer.content == bodies.CSV_HEADER + bodies.csv_lines(
            [*rows(3), *rows(2, 5)], own_sensors()
        )
        assert answer.headers["content-type"] == bodies.CSV_TYPE
        assert answer.headers["cache-control"] == "no-store"
        assert answer.headers["content-disposition"] == (
            'attachment; filename="lupin-twin_a_b_co2_'
            'from_19700101T000001Z_to_19700101T000009Z.csv"'
        )
        assert past.requested == [(NS, 9 * NS, "a/b", "co2")]
        # A history includes a reading of now, even if the clock is paused at it.
        monkeypatch.setattr(Bridge, "ros_time_ns", 9 * NS)
        await it.http.get(PATH)
        assert past.requested[-1] == (0, 9 * NS + 1, None, None)


async def test_head_reads_no_row_and_without_rows_there_is_a_header_or_empty_parquet(
    domain: int,
) -> None:
    past = MadeUp()
    async with remembering(past) as it:
        answer = await it.http.head(f"{PATH}?to=9")
        assert (answer.status_code, answer.content) == (200, b"")
        assert "19700101T000009Z" in answer.headers["content-disposition"]
        assert past.requested == []
        assert (await it.http.head(f"{PATH}?to=now")).status_code == 400
        assert (await it.http.get(PATH)).content == bodies.CSV_HEADER
        answer = await it.http.get("/api/export.parquet")
        assert parquet.read_table(pyarrow.BufferReader(answer.content)).num_rows == 0


async def test_parquet_has_the_same_rows_with_units_and_coordinates(domain: int) -> None:
    failed = PastRow(7 * NS, "8", math.nan, math.nan, "", math.nan, 2, "robot")
    # More than one row group.
    past = MadeUp(lots=[rows(4_000)] * (GROUP_ROWS // 4_000 + 1) + [[], [failed]])
    async with remembering(past) as it:
        answer = await it.http.get("/api/export.parquet?from=1&to=9&sensor_type=co2")
        assert answer.headers["content-type"] == "application/vnd.apache.parquet"
        assert answer.headers["content-disposition"].endswith('09Z.parquet"')
        file = parquet.ParquetFile(pyarrow.BufferReader(answer.content))
        assert file.num_row_groups == 2
        table = file.read()
        assert table.num_rows == sum(map(len, past.lots))
        first, last = table.slice(0, 1), table.slice(table.num_rows - 1)
        assert table.column_names == [
            *("time", "tag_id", "x_m", "y_m", "sensor", "unit", "value", "status", "source")
        ]
        assert first["time"].cast("int64").to_pylist() == [NS]
        assert first.drop(["time"]).to_pylist() == [
            {"tag_id": "7", "x_m": 1.0, "y_m": 2.0, "sensor": "co2", "unit": "ppm",
             "value": math.pi, "status": 0, "source": "robot"},
        ]  # fmt: skip
        assert last.drop(["time"]).to_pylist() == [
            {"tag_id": "8", "x_m": None, "y_m": None, "sensor": None, "unit": None,
             "value": None, "status": 2, "source": "robot"},
        ]  # fmt: skip
        schema = table.schema
        assert schema.field("value").metadata[b"units"] == b"ppm"
        assert schema.field("x_m").metadata[b"units"] == b"m"


async def test_parquet_without_its_package_is_refused_with_how_to_install_it(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    async with remembering(MadeUp(lots=[rows(1)])) as it:
        answer = await it.http.get("/api/export.parquet")
        assert answer.status_code == 501
        assert "pip install 'lupin-twin[science]'" in answer.json()["detail"]
        # Its place is free again, and CSV needs no package.
        assert (await it.http.get(PATH)).status_code == 200


async def test_an_export_to_a_reader_that_does_not_read_stops_and_is_cut_off(domain: int) -> None:
    lot = rows(1_000)
    past = MadeUp(lots=[lot] * MANY)
    async with remembering(past, Limits(client_timeout_s=1.0)) as it:
        with deaf_client(it.url, PATH) as client:
            await until(lambda: len(it.bridge.admission.exports) == 1, "the export")
            server = it.server.server_state.connections
            await until(
                lambda: sum(c.transport.get_write_buffer_size() > 0 for c in server) == 1,
                "a socket that is full",
            )
            await until(lambda: len(it.bridge.admission.exports) == 0, "its end")
            assert past.lots_taken * len(bodies.csv_lines(lot, own_sensors())) < MOST_TAKEN_BYTES
            assert past.is_closed
            with pytest.raises(ConnectionResetError):
                deque(iter(lambda: client.recv(65_536), b""))


async def test_a_client_has_one_export_and_a_disconnect_frees_its_place(domain: int) -> None:
    past = MadeUp(lots=[rows(1_000)] * MANY)
    async with remembering(past) as it:
        async with it.http.stream("GET", PATH) as answer:
            assert answer.status_code == 200
            refused = await it.http.get(PATH)
            assert (refused.status_code, refused.headers["retry-after"]) == (429, "5")
            assert refused.json() == {"detail": "127.0.0.1 has 1 export under way, the limit"}
            # It computes nothing while its reader is slow.
            assert it.bridge.admission.being_computed == 0
        await until(lambda: len(it.bridge.admission.exports) == 0, "its place")
        assert past.is_closed


async def test_slow_readers_do_not_keep_others_waiting(
    domain: int, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They take a byte now and then, and so are not cut off like readers that take nothing."""
    monkeypatch.setattr(admission, "LONG_EXPORT_S", 5.0)
    past = MadeUp(lots=[rows(1_000)] * MANY)
    async with remembering(past, Limits(client_timeout_s=3_600.0)) as it:
        with ExitStack() as stack:
            slow = [
                stack.enter_context(raw_http.connect(it.url, f"127.0.9.{number}", room=4_096))
                for number in range(1, EXPORTS + 1)
            ]
            for client in slow:
                client.sendall(f"GET {PATH} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            await until(lambda: len(it.bridge.admission.exports) == EXPORTS, "all places taken")
            refused = await it.http.get(PATH)
            assert refused.status_code == 503
            assert refused.headers["retry-after"] == "5"

            async def is_served() -> bool:
                for client in slow:
                    client.recv(1)
                async with it.http.stream("GET", PATH) as answer:
                    return answer.status_code == 200

            await until_answered(is_served, "an export")
            with pytest.raises(ConnectionResetError):
                deque(iter(lambda: slow[0].recv(65_536), b""))
        await until(lambda: len(it.bridge.admission.exports) == 0, "their places")
    assert "the export of 127.0.9.1 is old and is ended for another one" in caplog.text
    assert [record for record in caplog.records if record.levelname == "ERROR"] == []


async def test_a_disconnect_while_a_batch_is_read_ends_the_reading(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    """The batches are closed once no reader uses them, and not before."""
    is_reading, is_closed = asyncio.Event(), asyncio.Event()

    async def lots(*_: object) -> AsyncIterator[bytes]:
        try:
            yield b"a lot\r\n"
            is_reading.set()
            await asyncio.Event().wait()
        finally:
            await asyncio.sleep(0)  # a reader holds resources
            is_closed.set()

    async with remembering(MadeUp()) as it:
        it.twin.rows = lots  # type: ignore[assignment]
        async with it.http.stream("GET", PATH):
            await until(is_reading.is_set, "the second lot being read")
        await until(is_closed.is_set, "its end")
        await until(lambda: len(it.bridge.admission.exports) == 0, "its place")
    assert [record for record in caplog.records if record.levelname == "ERROR"] == []


async def test_a_batch_that_does_not_arrive_in_time_ends_the_export_with_one_line_in_the_log(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    async def lots(*_: object) -> AsyncIterator[bytes]:
        yield b"a lot\r\n"
        await asyncio.Event().wait()

    async with remembering(MadeUp(), Limits(answer_timeout_s=1.0)) as it:
        it.twin.rows = lots  # type: ignore[assignment]
        with pytest.raises(httpx.TransportError):
            await it.http.get(PATH)
        await until(lambda: len(it.bridge.admission.exports) == 0, "its place")
    assert "an export ended early: the answer was not ready within 1 s" in caplog.text
    assert "Traceback" not in caplog.text


async def test_a_shutdown_ends_the_export(domain: int) -> None:
    past = MadeUp(lots=[rows(1_000)] * 1_000 * MANY)  # more than can be read before the shutdown
    async with remembering(past) as it, it.http.stream("GET", PATH) as answer:
        it.server.should_exit = True
        await until(lambda: it.bridge.liveness.shutting_down, "the good-bye")
        with pytest.raises(httpx.TransportError):
            async for _ in answer.aiter_raw():
                pass
        await until(lambda: len(it.bridge.admission.exports) == 0, "its place")


async def test_an_error_in_the_middle_never_looks_like_the_end(domain: int) -> None:
    past = MadeUp(lots=[rows(3)], error=OSError("the disk is away"))
    async with remembering(past) as it:
        with pytest.raises(httpx.TransportError):
            await it.http.get(PATH)
        await until(lambda: len(it.bridge.admission.exports) == 0, "its place")
        # Also without chunked encoding: a reset connection is no end.
        reader, writer = await asyncio.open_connection(*it.url.removeprefix("http://").split(":"))
        writer.write(f"GET {PATH} HTTP/1.0\r\nHost: localhost\r\n\r\n".encode())
        try:
            with pytest.raises(ConnectionResetError):
                await reader.read()
        finally:
            writer.close()
