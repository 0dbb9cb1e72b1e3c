"""A robot of standard messages only, `lupin-twin adapt`, a twin, and what the page then shows."""

import re
import sys
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.browser.hmi import OpenPage
from tests.support import standard_robot
from tests.support.domains import own_domain, ros_env
from tests.support.processes import Process
from tests.support.web import bridge
from tests.twin.adapt.test_adapt import adapt

# The least that has to work.
CONFIG = """
robot: {topic: /amcl_pose, type: geometry_msgs/msg/PoseWithCovarianceStamped}
tags: {A: [0.0, 0.0], B: [3.0, 0.0]}        # surveyed; or a file
reach_m: 0.8
sensors:
  temperature: {topic: /temperature, type: sensor_msgs/msg/Temperature, field: temperature}
  humidity: {topic: /humidity, type: sensor_msgs/msg/RelativeHumidity, field: relative_humidity, factor: 100}
"""  # noqa: E501


def test_the_page_shows_what_a_robot_of_standard_messages_reads_and_where(
    tmp_path: Path, open_page: OpenPage
) -> None:
    config = tmp_path / "adapt.yaml"
    config.write_text(CONFIG)
    with (
        own_domain() as domain,
        bridge(domain=domain) as twin,
        Process([sys.executable, standard_robot.__file__], ros_env(domain)),
        adapt(domain, "--config", str(config)) as process,
    ):
        hmi = open_page(twin.url)
        for tag_id, celsius in (("A", "21.5"), ("B", "24.0")):
            expect(hmi.cell(tag_id, "temperature")).to_have_text(celsius)
            expect(hmi.cell(tag_id, "humidity")).to_have_text("60.0")
        hmi.expect_rows("A", "B")
        hmi.expect_samples(2)
        expect(hmi.test_id("robot-fact")).to_have_text(
            re.compile(r"Robot: (0\.2|1\.6|3\.1) m, 0\.0 m; \d+\ss ago")
        )
        # A pin is where its tag is: a click there opens the tag's card.
        for tag_id, x in (("A", 0.0), ("B", 3.0)):
            hmi.click_map(x, 0.0)
            expect(hmi.card(tag_id)).to_contain_text("Visited by the robot")
            hmi.page.keyboard.press("Escape")
        state = {tag["tag_id"]: tag["pose"]["position"] for tag in twin.json("/api/state")["tags"]}
        assert {tag_id: at["x"] for tag_id, at in state.items()} == pytest.approx(
            {"A": 0.0, "B": 3.0}
        )
        assert process.stop() == 0
