"""What a twin shows whose journal is not what it should be: where it is told, and how it heals."""

import sqlite3
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.support.inprocess import Running, running
from tests.support.journal import SECOND, is_whole, kept, scan, select
from tests.support.messages import scan as observation
from tests.support.ros import Peer
from tests.support.waiting import until, until_answered
from tests.support.web import filled

# The latest that ROS time can say, in January 2038: one of 2099 has no message.
LATEST_S = 2_147_483_647.0


def begun(path: Path) -> None:
    """A journal of a twin that has ended, with five thousand scans of tag 7."""
    now_ns = time.time_ns() - 6000 * SECOND
    kept(path, [scan("7", now_ns + n * SECOND, co2=float(n)) for n in range(5000)])


def truncated(path: Path) -> None:
    begun(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


def flipped(path: Path) -> None:
    begun(path)
    broken = bytearray(path.read_bytes())
    broken[len(broken) // 2] ^= 0x10
    path.write_bytes(broken)


def no_database(path: Path) -> None:
    path.write_text("the diary of a gardener\n" * 1000)


def foreign(path: Path) -> None:
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE diary (day TEXT)")


def serve(path: Path) -> Any:
    return running(ros_args=["--ros-args", "-p", f"journal:={path}"])


async def told(live: Running, state: str, part: str = "") -> dict[str, Any]:
    """What /readyz says of the journal once that is so; the twin is live."""

    def look() -> bool:
        journal = live.bridge.status.update.journal
        return journal.state == state and part in journal.detail

    await until(
        look, f"a journal that is {state} ({part}), not {live.bridge.status.update.journal}"
    )
    # A machine that stood still for seconds makes any twin silent, until its next state.
    answer = await until_answered(
        lambda: live.http.get("/readyz"), "the twin to be live", lambda it: it.status_code == 200
    )
    metrics = (await live.http.get("/metrics")).text
    assert f"lupin_journal_recording {float(state == 'recording')}" in metrics
    journal: dict[str, Any] = answer.json()["journal"]
    return journal


async def shows(live: Running, tag_id: str, value: float) -> None:
    """Wait until what was just observed is shown, whatever the journal does."""
    await until(
        lambda: any(
            tag.tag_id == tag_id and tag.readings[0].value == value
            for tag in live.twin.update.snapshot.tags
        ),
        f"{value} at tag {tag_id}",
    )


@pytest.mark.parametrize("damage", [truncated, flipped, no_database])
async def test_a_damaged_file_is_quarantined_read_as_far_as_it_goes_and_named(
    damage: Callable[[Path], None], domain: int, tmp_path: Path
) -> None:
    path = tmp_path / "j.sqlite"
    damage(path)
    broken = path.read_bytes()
    with Peer(domain) as robot:
        async with serve(path) as live:
            journal = await told(live, "recording", "a damaged journal was quarantined as")
            aside = Path(journal["set_aside"])
            assert aside.name.startswith("j.sqlite.damaged-")
            assert aside.read_bytes() == broken
            known = {tag.tag_id for tag in live.twin.update.snapshot.tags}
            assert known == ({"7"} if damage is not no_database else set())
            robot.observe(observation("8", {"co2": 1.0}))
            await shows(live, "8", 1.0)
    assert is_whole(path)
    kept_rows = select(
        path, "SELECT tag, count(*) FROM scan JOIN series USING (series) GROUP BY tag ORDER BY tag"
    )
    rows = {str(tag_id): int(str(count)) for tag_id, count in kept_rows}
    assert rows["8"] == 1
    if damage is not no_database:
        assert rows["7"] > 1000


async def test_somebody_else_s_file_is_left_and_told_until_it_is_gone(
    domain: int, tmp_path: Path
) -> None:
    path = tmp_path / "j.sqlite"
    foreign(path)
    theirs = path.read_bytes()
    with Peer(domain) as robot:
        async with serve(path) as live:
            await told(live, "foreign", "is a database, but not a journal of lupin-twin")
            robot.observe(observation("8", {"co2": 1.0}))
            await shows(live, "8", 1.0)
            assert path.read_bytes() == theirs
            path.unlink()
            await told(live, "recording")
            await until(lambda: live.twin.journal().written == 1, "what waited")


async def test_a_stamp_of_years_ahead_counts_as_made_on_arrival_and_is_kept_so(
    domain: int, tmp_path: Path
) -> None:
    """Also when it is heard again, after a restart: it is no younger, and not written twice."""
    path = tmp_path / "j.sqlite"
    message = observation("8", {"co2": 1.0}, stamp_s=LATEST_S)
    stamps = []
    for _ in range(2):
        with Peer(domain) as robot:
            async with serve(path) as live:
                robot.observe(message)
                await shows(live, "8", 1.0)
                (tag,) = (await live.http.get("/api/state")).json()["tags"]
                stamps.append(filled(tag)["readings"][0]["observed_at"])
                reach = None
                # What was just heard is in the journal a moment later; before, the one that
                # ended has to leave it.
                while reach is None:
                    reach = (await live.http.get("/api/timeline")).json().get("reach")
                assert reach["to"]["sec"] <= time.time()
    assert stamps[0] == stamps[1]
    assert abs(stamps[0]["sec"] - time.time()) < 60
    ((stamp_ns, own_ns),) = select(path, "SELECT stamp_ns, own_stamp_ns FROM scan")
    assert own_ns == int(LATEST_S) * SECOND
    assert stamp_ns == stamps[0]["sec"] * SECOND + stamps[0]["nanosec"]
