"""Test support whose failure would only show as slowness or as full memory."""

import fcntl
import os
import sys
from pathlib import Path

from tests.support.domains import LOCK, YOUNG_S, remove_what_the_dead_left, ros_env
from tests.support.template import PROGRAMS, Template


def test_the_programs_of_the_tests_are_forked_and_not_imported_anew(domain: int) -> None:
    template = Template(imported=())
    try:
        for program in PROGRAMS:
            assert template.can_be([sys.executable, "-m", program], ros_env(domain)), program
    finally:
        template.end()


def segment(folder: Path, name: str, age_s: float = 2 * YOUNG_S) -> Path:
    """A segment with its lock, both `age_s` old; returns the lock."""
    lock = folder / f"{name}{LOCK}"
    for path in (folder / name, lock):
        path.touch()
        os.utime(path, (path.stat().st_mtime - age_s,) * 2)
    return lock


def test_only_old_unlocked_segments_are_removed(tmp_path: Path) -> None:
    segment(tmp_path, "fastrtps_dead")
    segment(tmp_path, "fastrtps_young", age_s=0.0)
    segment(tmp_path, "fastrtps_port7400")
    segment(tmp_path, "of_somebody_else")
    with segment(tmp_path, "fastrtps_alive").open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_SH)
        before = set(tmp_path.iterdir())
        assert remove_what_the_dead_left(tmp_path) == 1
    gone = before - set(tmp_path.iterdir())
    assert {path.name for path in gone} == {"fastrtps_dead", f"fastrtps_dead{LOCK}"}
