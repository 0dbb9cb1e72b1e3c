"""What nodes log, in the bridge's log."""

import json
import logging
from typing import Any

import pytest
from rclpy.logging import get_logger

from lupin_bridge.feed.ros_thread import forward
from tests.support.messages import scan
from tests.support.processes import url_of
from tests.support.ros import Peer
from tests.support.sabotage import sabotaged

BROKEN = ("--raise", "lupin_twin.core.state:TwinStore.record:boom")


def entries(output: str) -> list[dict[str, Any]]:
    """The log of a process, of which every line but the address is an object."""
    lines = [line for line in output.splitlines() if not line.startswith("lupin-twin: http")]
    return [json.loads(line) for line in lines]


def test_of_a_bridge_that_logs_json_every_line_is_an_object(domain: int) -> None:
    arguments = ("serve", "--port", "0", "--log-format", "json", "--ros-args", "-p", "idw_power:=3")
    with (
        sabotaged(domain, BROKEN, "lupin_bridge.cli.command", *arguments) as process,
        Peer(domain) as robot,
    ):
        url_of(process)
        robot.observe(scan("elsewhere", {"co2": 1.0}, frame_id="odom"), scan("boom", {"co2": 1.0}))
        process.wait_for_output("odom")
        process.wait_for_output("sabotage of")
        process.stop()
        written = entries(process.output)
    told = {entry["level"]: entry for entry in written if entry["logger"] == "lupin_twin"}
    assert "'odom'" in told["warning"]["message"]
    assert "Traceback" in told["error"]["message"], "a trace of many lines is in one"


def test_all_severities_are_handed_on_once_and_as_they_are(
    caplog: pytest.LogCaptureFixture,
) -> None:
    forward()
    forward()
    logger = get_logger("probe")
    logger.info("100 %s")
    logger.warning("careful")
    logger.error("broken")
    logger.fatal("gone")
    for _ in range(2):
        logger.warning("told once", once=True)
    logger.debug("not told")
    told = [(record.levelno, record.message) for record in caplog.records if record.name == "probe"]
    assert told == [
        (logging.INFO, "100 %s"),
        (logging.WARNING, "careful"),
        (logging.ERROR, "broken"),
        (logging.CRITICAL, "gone"),
        (logging.WARNING, "told once"),
    ]
