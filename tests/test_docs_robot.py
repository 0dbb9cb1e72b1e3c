"""The programs of the tutorial for one's own robot: a real twin accepts their messages."""

import subprocess
import sys
from pathlib import Path

from tests.support.docs import block_named
from tests.support.domains import ros_env
from tests.support.processes import OFTEN, Process, twin_node
from tests.support.ros import Peer


def test_the_tutorials_robot_and_camera_work(domain: int, tmp_path: Path) -> None:
    robot, camera = tmp_path / "robot.py", tmp_path / "camera.py"
    robot.write_text(block_named("robot").text, encoding="utf-8")
    camera.write_text(block_named("inspection").text, encoding="utf-8")
    env = ros_env(domain)
    with twin_node(domain, *OFTEN), Peer(domain) as peer:
        peer.wait_for_twin()
        with Process([sys.executable, str(robot)], env):
            third = peer.tag("3")
            first, second = peer.tag("1"), peer.tag("2")
        assert [reading.name for reading in first.readings] == ["temperature", "humidity"]
        for tag, place in ((first, (1.0, 0.5)), (second, (2.5, 3.0))):
            assert tag.pose.orientation.w == 1.0
            assert (tag.pose.position.x, tag.pose.position.y) == place
        assert (third.pose.orientation.w, len(third.readings)) == (0.0, 0)

        subprocess.run([sys.executable, camera], env=env, check=True, timeout=60)
        seen = peer.tag("1", lambda tag: tag.anomaly)
        assert (seen.species, seen.flower_count, seen.bug_count) == ("orchid", 7, 2)
        assert seen.pose == first.pose
