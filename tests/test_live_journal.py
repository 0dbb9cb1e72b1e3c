"""What a twin shows whose journal is not what it should be: where it is told, and how it heals."""

import sqlite3
import time
from contextlib import closing
from pathlib import Path
from typing import Any

from tests.support.inprocess import Running, running
from tests.support.journal import SECOND, is_whole, kept, scan, select
from tests.support.messages import scan as observation
from tests.support.ros import Peer
from tests.support.waiting import until, until_answered


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


async def shows(live: Running, robot: Peer) -> None:
    """What is observed now, whatever the journal does."""
    robot.observe(observation("8", {"co2": 1.0}))
    await until(
        lambda: "8" in [tag.tag_id for tag in live.twin.update.snapshot.tags], "what was observed"
    )


async def test_a_damaged_file_is_quarantined_read_as_far_as_it_goes_and_named(
    domain: int, tmp_path: Path
) -> None:
    path = tmp_path / "j.sqlite"
    now_ns = time.time_ns() - 6000 * SECOND
    kept(path, [scan("7", now_ns + n * SECOND, co2=float(n)) for n in range(5000)])
    whole = path.read_bytes()
    broken = whole[: len(whole) // 2]
    path.write_bytes(broken)
    with Peer(domain) as robot:
        async with serve(path) as live:
            journal = await told(live, "recording", "a damaged journal was quarantined as")
            aside = Path(journal["set_aside"])
            assert aside.name.startswith("j.sqlite.damaged-")
            assert aside.read_bytes() == broken
            assert [tag.tag_id for tag in live.twin.update.snapshot.tags] == ["7"]
            await shows(live, robot)
    assert is_whole(path)
    counts = "SELECT tag, count(*) FROM scan JOIN series USING (series) GROUP BY tag"
    of_7, of_8 = (int(str(count)) for _, count in select(path, f"{counts} ORDER BY tag"))
    assert of_7 > 1000
    assert of_8 == 1


async def test_somebody_else_s_file_is_left_and_told_until_it_is_gone(
    domain: int, tmp_path: Path
) -> None:
    path = tmp_path / "j.sqlite"
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE diary (day TEXT)")
    theirs = path.read_bytes()
    with Peer(domain) as robot:
        async with serve(path) as live:
            await told(live, "foreign", "is a database, but not a journal of lupin-twin")
            await shows(live, robot)
            assert path.read_bytes() == theirs
            path.unlink()
            await told(live, "recording")
            await until(lambda: live.twin.journal().written == 1, "what waited")
