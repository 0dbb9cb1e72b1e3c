"""Copies of journals: the newest serves at once, and those of twins long gone are deleted."""

import asyncio
import os
import time
from pathlib import Path

from lupin_bridge.feed.web import RETAINED_S, FollowedLog
from lupin_twin.core.parameters import World
from lupin_twin.core.past import NotRemembered
from lupin_twin.journal.follow import Lot, write
from lupin_twin.runtime.workers import Workers
from tests.support.journal import NOW, recording, scan
from tests.support.waiting import wait_for


def copies(folder: Path, *ages_s: float) -> list[Path]:
    """One file for each age, of a journal of its own."""
    paths = [folder / f"{number:032}.sqlite" for number in range(len(ages_s))]
    for path, age_s in zip(paths, ages_s, strict=True):
        write(path, Lot(path.stem, (), 0, is_all=True), 1)
        os.utime(path, (time.time() - age_s,) * 2)
    return paths


def left_after_start(folder: Path) -> tuple[str | None, list[Path]]:
    """The file that is read at once, and those that are left."""

    async def test() -> str | None:
        async def query(_after: int) -> Lot:
            raise NotRemembered("nobody is there", is_lasting=False)

        log = FollowedLog(query, Workers("test"))
        await log.start(folder)
        condition = log.condition
        await log.stop()
        return None if condition is None else condition.path

    return asyncio.run(test()), sorted(folder.glob("*.sqlite"))


def test_a_copy_that_was_not_written_for_long_is_deleted_at_the_start(tmp_path: Path) -> None:
    newest, recent, _ = paths = copies(tmp_path, 60.0, RETAINED_S - 60.0, RETAINED_S + 60.0)
    assert left_after_start(tmp_path) == (str(newest), paths[:2])
    assert recent.exists()


def test_the_newest_stays_however_old_it_is(tmp_path: Path) -> None:
    newest, _ = copies(tmp_path, RETAINED_S + 60.0, RETAINED_S + 120.0)
    assert left_after_start(tmp_path) == (str(newest), [newest])


def test_a_file_that_is_named_is_read_before_its_twin_is_heard(tmp_path: Path) -> None:
    journal = tmp_path / "j.sqlite"
    with recording(journal, world=World("simulated", 1_440.0)) as twin:
        twin.write(scan())
        wait_for(lambda: twin.condition.written == 1, "it")

    async def test() -> None:
        async def query(_after: int) -> Lot:
            raise NotRemembered("nobody is there", is_lasting=False)

        log = FollowedLog(query, Workers("test"), journal)
        await log.start(tmp_path / "copies")
        await log.wait()
        condition = log.condition
        assert condition is not None
        assert (condition.path, condition.complete_ns) == (str(journal), NOW)
        assert log.world == World("simulated", 1_440.0)
        await log.stop()

    asyncio.run(test())
