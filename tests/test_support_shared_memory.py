"""Memory of dead processes is removed, and nothing of living ones."""

import fcntl
import os
import sys
from pathlib import Path

import pytest

from tests.support.domains import ros_env
from tests.support.processes import Process
from tests.support.shared_memory import LOCK, YOUNG_S, remove_what_the_dead_left

PARTICIPANT = (
    "import rclpy, signal; rclpy.init(); node = rclpy.create_node('n'); "
    "print('there', flush=True); signal.pause()"
)


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


def test_a_participant_locks_its_segment_as_long_as_it_lives(domain: int) -> None:
    with Process([sys.executable, "-c", PARTICIPANT], ros_env(domain)) as process:
        process.wait_for_output("there")
        files = {path.readlink() for path in Path(f"/proc/{process.pid}/fd").iterdir()}
        [lock] = [path for path in files if path.match(f"/dev/shm/fastrtps_[!p]*{LOCK}")]
        with lock.open("rb") as file:
            with pytest.raises(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            process.kill()
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            assert lock.exists(), "a killed process leaves it behind"
