"""The past over HTTP, from a real journal: as it was, and the same after a kill and in `web`."""

import csv
import io
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.support.domains import own_domain
from tests.support.journal import select
from tests.support.live import attached
from tests.support.messages import look, occupancy_grid, scan
from tests.support.processes import OFTEN, limits, lupin_twin
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, without_ages

# Observations of an afternoon long ago, s; so long after it everything is asked for.
T = 1_700_000_000
AT = T + 150.5
FIELD = "sensor_type=co2&resolution=0.5"
PATHS = (
    f"/api/state?at={AT}",
    f"/api/tags/a?at={AT}",
    f"/api/field.json?{FIELD}&at={AT}",
    f"/api/field.npy?{FIELD}&at={AT}",
    f"/api/field.png?{FIELD}&at={AT}&scale=3",
    f"/api/field/quality?{FIELD}&at={AT}",
    f"/api/history?tag_id=a&sensor_type=co2&from={T}&to={T + 400}",
)
# And no machine is too busy for an answer: the process that looks back gives way to all others.
EAGER = limits(answers_per_s=10_000, answer_timeout_s=PATIENCE_S)
CLIPPED = (*EAGER, *OFTEN)


class House:
    """A domain with its robot, and bridges that come and go."""

    def __init__(self, journal: Path, domain: int, peer: Peer) -> None:
        self.journal, self.domain, self.peer = journal, domain, peer

    def serve(self, stack: ExitStack, role: str = "serve") -> Bridge:
        kept = ("-p", f"journal:={self.journal}") if role == "serve" else ()
        process = stack.enter_context(lupin_twin(self.domain, role, *CLIPPED, *kept))
        running = stack.enter_context(attached(process, self.peer))
        wait_for(lambda: says_all(running), "a live twin that tells of its journal")
        return running

    def scans(self) -> int:
        return len(select(self.journal, "SELECT seq FROM scan"))


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[House]:
    journal = tmp_path_factory.mktemp("journal") / "twin.sqlite"
    with own_domain() as domain, Peer(domain) as peer:
        it = House(journal, domain, peer)
        with ExitStack() as stack:
            it.serve(stack)
            peer.observe(
                scan("a", {"co2": 400.0, "light": float("nan")}, (1.0, 1.0), stamp_s=T),
                scan("b", {"co2": 500.0}, (2.0, 1.0), stamp_s=T + 50.0),
                look("a", "lupin", anomaly=True, bug_count=3, stamp_s=T + 60.0),
                scan("a", {"co2": 420.0}, stamp_s=T + 100.25),
                scan("a", status=2, stamp_s=T + 110.0),
                scan("a", {"co2": 900.0}, stamp_s=T + 200.0),
                scan("=c", {"co2": 1.0}, stamp_s=T + 300.0),
            )
            wait_for(lambda: it.scans() == 6, "all of it in the journal")
        yield it


def says_all(running: Bridge) -> bool:
    answer = running.get("/readyz")
    return answer.status_code == 200 and answer.json()["journal"]["state"] == "recording"


def answers(running: Bridge, etags: dict[str, str] | None = None) -> dict[str, httpx.Response]:
    """The answer of every path, asked with the ETag that is known."""
    found = {}
    for path in PATHS:
        headers = {"If-None-Match": etags[path]} if etags else None
        found[path] = running.http.get(path, headers=headers)
    return found


def test_after_a_kill_and_in_web_the_past_is_the_same_and_so_are_its_etags(house: House) -> None:
    a_map = occupancy_grid([[0] * 200] * 40, 0.05)
    with ExitStack() as stack:
        first = house.serve(stack)
        house.peer.publish_map(a_map)
        wait_for(lambda: first.get("/api/map").status_code == 200, "the map")
        before = answers(first)
        assert {answer.status_code for answer in before.values()} == {200}
        etags = {path: answer.headers["etag"] for path, answer in before.items()}
        assert len(set(etags.values())) == len(PATHS)
        web = house.serve(stack, "web")
        wait_for(lambda: web.get("/api/map").status_code == 200, "the map in web")
        replica = answers(web)
        for path in PATHS:
            assert replica[path].content == before[path].content, path
            assert replica[path].headers["etag"] == etags[path]
        first.process.kill()
    with ExitStack() as stack:
        second = house.serve(stack)
        wait_for(lambda: second.get("/api/map").status_code == 200, "the latched map")
        for path, answer in answers(second, etags).items():
            assert (answer.status_code, answer.content) == (304, b""), path
        for path, answer in answers(second).items():
            assert answer.content == before[path].content, path
        # What was observed before and is heard late belongs to its own time.
        house.peer.observe(scan("b", {"co2": 777.0}, stamp_s=T + 140.0))
        wait_for(lambda: house.scans() == 7, "it in the journal")
        changed = {path for path, a in answers(second, etags).items() if a.status_code == 200}
        assert changed == set(PATHS) - {PATHS[1], PATHS[-1]}, "of the other tag nothing has"
        earlier = second.json(f"/api/state?at={T + 139}")
        assert [reading["value"] for reading in earlier["tags"][1]["readings"]] == [500.0]


def test_a_moment_is_told_as_it_was(house: House) -> None:
    with ExitStack() as stack:
        live = house.serve(stack)
        state = live.json(f"/api/state?at={AT}")
        assert state["header"]["stamp"] == {"sec": T + 150, "nanosec": 500_000_000}
        ages = {tag["tag_id"]: tag["stale_seconds"] for tag in state["tags"]}
        assert set(ages) == {"a", "b"}
        assert ages["a"] == 50.25
        a = state["tags"][0]
        assert (a["readings"][0]["value"], a["bug_count"], a["last_try_status"]) == (420.0, 3, 2)
        assert live.json(f"/api/state?at={T - 1}")["tags"] == []
        assert live.get(f"/api/tags/=c?at={T + 299}").status_code == 404
        assert live.get(f"/api/tags/=c?at={T + 300}").status_code == 200
        now = live.json("/api/state")
        stamp = now["header"]["stamp"]
        then = live.json(f"/api/state?at={stamp['sec']}.{stamp['nanosec']:09d}")
        assert without_ages(then) == without_ages(now)
        history = live.json(f"/api/history?tag_id=a&sensor_type=co2&from={T}&to={T + 200}")
        assert [reading["value"] for reading in history["readings"]] == [400.0, 420.0]
        timeline = live.json(f"/api/timeline?from={T}&to={T + 400}&points=4")
        pests = [(b["scans"] > 0, b["pests_seen"]) for b in timeline["buckets"]]
        assert pests[0] == (True, 1)
        assert timeline["reach"]["from"] == {"sec": T, "nanosec": 0}


def test_an_export_holds_every_reading_and_every_failed_try(house: House) -> None:
    with ExitStack() as stack:
        live = house.serve(stack)
        answer = live.get(f"/api/export.csv?from={T}&to={T + 301}")
        rows: list[dict[str, Any]] = list(csv.DictReader(io.StringIO(answer.text, newline="")))
        told = [(r["stamp"], r["tag_id"], r["sensor"], r["value"], r["status"]) for r in rows]
        assert (f"{T}.000000000", "a", "light", "", "0") in told
        assert (f"{T + 110}.000000000", "a", "", "", "2") in told
        assert (f"{T + 300}.000000000", "'=c", "co2", "1.0", "0") in told
        assert {(r["x_m"], r["y_m"]) for r in rows if r["tag_id"] == "a"} == {("1.0", "1.0")}
        assert {r["source"] for r in rows} == {"test"}
        assert [r["stamp"] for r in rows] == sorted(r["stamp"] for r in rows)


def test_what_is_derived_has_a_past_too_the_same_in_web(house: House) -> None:
    with ExitStack() as stack:
        live, before = house.serve(stack), house.scans()
        house.peer.observe(
            scan("v", {"temperature": 20.0, "humidity": 50.0}, stamp_s=T + 10.0),
            scan("v", {"temperature": 30.0}, stamp_s=T + 20.0),
            scan("v", {"temperature": 30.0, "humidity": 50.0}, stamp_s=T + 30.0),
        )
        wait_for(lambda: house.scans() == before + 3, "all of it in the journal")
        web = house.serve(stack, "web")
        path = f"/api/history?tag_id=v&sensor_type=vpd&from={T}&to={T + 60}"
        told = live.json(path)
        assert [(it["stamp"]["sec"] - T, round(it["value"], 3)) for it in told["readings"]] == [
            (10, 1.169),
            (30, 2.122),
        ]
        assert (told["unit"], told["buckets"]) == ("kPa", [])
        (bucket,) = live.json(f"{path}&points=1")["buckets"]
        assert (bucket["n"], round(bucket["mean"], 3)) == (2, 1.645)
        for query in ("", "&points=1"):

            def same(path: str = path + query) -> bool:
                there = web.get(path)
                return there.status_code == 200 and there.content == live.get(path).content

            wait_for(same, "the same in web")
