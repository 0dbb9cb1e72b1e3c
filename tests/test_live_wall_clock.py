"""A board whose wall clock is wrong at the start: it costs no past, and everybody is told.

Real processes; the clock of each is the test's (`WallClock`), and the robot stamps by it too.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from lupin_twin.core.state import Write
from tests.support.domains import own_domain
from tests.support.journal import SECOND, kept, pin, select
from tests.support.journal import scan as row
from tests.support.live import attached
from tests.support.messages import scan
from tests.support.processes import OFTEN, limits, lupin_twin
from tests.support.waiting import PATIENCE_S
from tests.support.wall_clock import WallClock
from tests.support.web import Bridge, bridge

DAY_S = 86_400
# Years.
BEHIND_S = -6 * 365 * DAY_S
DAYS = 365
TAGS = ("1", "2", "3")


class Year:
    """A journal of a year, a scan of each tag a day, the last of them an hour ago."""

    def __init__(self, path: Path) -> None:
        self.path = path
        last_ns = (int(time.time()) - 3_600) * SECOND
        self.stamps_s = [last_ns // SECOND - DAY_S * day for day in range(DAYS)][::-1]
        rows: list[Write] = [pin(tag, self.stamps_s[0] * SECOND, float(tag)) for tag in TAGS]
        rows += [
            row(tag, at_s * SECOND, co2=number + float(tag) / 10)
            for number, at_s in enumerate(self.stamps_s)
            for tag in TAGS
        ]
        kept(path, rows)

    @property
    def options(self) -> tuple[str, ...]:
        kept = ("-p", f"journal:={self.path}", "-p", "journal_days:=400.0")
        return (*limits(answer_timeout_s=PATIENCE_S), *OFTEN, *kept)

    def scans(self) -> int:
        [(count,)] = select(self.path, "SELECT count(*) FROM scan WHERE is_copy = 0")
        assert isinstance(count, int)
        return count


@pytest.fixture
def year(tmp_path: Path) -> Year:
    return Year(tmp_path / "journal.sqlite")


@contextmanager
def both(year: Year, clock: WallClock) -> Iterator[tuple[Bridge, Bridge]]:
    """`serve` by the clock, and a `web` of it on a host whose clock is right."""
    with (
        own_domain() as domain,
        bridge(*year.options, domain=domain, afresh=True, **clock.env) as twin,
        lupin_twin(domain, "web", *limits(answer_timeout_s=PATIENCE_S)) as process,
        attached(process, twin.peer) as apart,
    ):
        twin.peer.until(lambda: apart.get("/api/state").status_code == 200, "a twin at web")
        yield twin, apart


def status(live: Bridge) -> Any:
    return live.get("/readyz").json()


def values(tags: list[Any]) -> dict[str, list[float]]:
    return {tag["tag_id"]: [reading["value"] for reading in tag["readings"]] for tag in tags}


def check_year(live: Bridge, year: Year) -> None:
    """All of it is told: as of each month, the history, the timeline, and the export."""
    for number in range(0, DAYS, 30):
        state = live.json("/api/state", at=year.stamps_s[number] + 60)
        assert values(state["tags"]) == {tag: [number + float(tag) / 10] for tag in TAGS}
    of: dict[str, Any] = {"from": year.stamps_s[0], "to": year.stamps_s[-1] + 1}
    for tag in TAGS:
        told = live.json("/api/history", tag_id=tag, sensor_type="co2", points=5_000, **of)
        assert [it["value"] for it in told["readings"]] == [
            number + float(tag) / 10 for number in range(DAYS)
        ]
    scans = DAYS * len(TAGS)
    timeline = live.json("/api/timeline", **of)
    assert sum(bucket["scans"] for bucket in timeline["buckets"]) == scans
    assert timeline["reach"]["from"]["sec"] == year.stamps_s[0]
    assert len(live.get("/api/export.csv", **of).text.splitlines()) == 1 + scans


def test_a_start_in_the_past_hides_nothing_for_longer_than_the_clock_is_wrong(
    year: Year, tmp_path: Path
) -> None:
    clock = WallClock(tmp_path, BEHIND_S)
    last = {tag: [DAYS - 1 + float(tag) / 10] for tag in TAGS}
    with both(year, clock) as (twin, apart):
        peer, said = twin.peer, list[DiagnosticArray]()
        peer.node.create_subscription(DiagnosticArray, "/diagnostics", said.append, 10)
        # What was known last is shown, and nobody says how old it is.
        for live in (twin, apart):
            peer.until(
                lambda live=live: status(live)["journal"]["state"] == "doubting",  # type: ignore[misc]
                "a clock that contradicts the journal",
            )
            told = status(live)
            assert live.get("/readyz").status_code == 503
            assert told["reason"] == "clock_doubted"
            assert "contradicts" in told["message"]
            assert "contradicts the journal" in told["journal"]["detail"]
            tags = live.json("/api/state")["tags"]
            assert values(tags) == last
            assert {tag["stale_seconds"] for tag in tags} == {None}
            with live.listen() as listening:
                listening.until("status", lambda frame: frame["journal"]["state"] == "doubting")

        def levels() -> dict[str, bytes]:
            return {it.name: it.level for it in said[-1].status} if said else {}

        for name in ("clock", "journal"):
            key = f"/lupin_twin: {name}"
            peer.until(lambda key=key: levels().get(key) == DiagnosticStatus.ERROR, key)  # type: ignore[misc]
        assert "contradicts the journal" in twin.process.output
        # What is observed meanwhile is shown, and waits.
        peer.observe(scan("1", {"co2": 1_000.0}, stamp_s=clock.now_s()))
        twin.tag("1", lambda tag: values([tag])["1"] == [1_000.0])
        assert year.scans() == DAYS * len(TAGS)

        clock.be_off(0)
        for live in (twin, apart):
            peer.until(
                lambda live=live: status(live)["journal"]["state"] == "recording",  # type: ignore[misc]
                "a journal that is written again",
            )
            peer.until(lambda live=live: live.get("/readyz").status_code == 200, "a live twin")  # type: ignore[misc]
        peer.until(lambda: year.scans() == DAYS * len(TAGS) + 1, "what waited in the journal")
        now = {**last, "1": [1_000.0]}
        for live in (twin, apart):
            tags = live.json("/api/state")["tags"]
            assert values(tags) == now
            ages = {tag["tag_id"]: tag["stale_seconds"] for tag in tags}
            assert ages["1"] < 60
            assert ages["2"] > 3_000
            check_year(live, year)
    assert select(year.path, "SELECT run, joins FROM run") == [(1, None)]

    with both(year, clock) as (twin, apart):
        for live in (twin, apart):
            live.tag("1", lambda tag: tag["stale_seconds"] is not None)
            assert values(live.json("/api/state")["tags"]) == now
            check_year(live, year)
