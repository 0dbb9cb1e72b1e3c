"""A disk that runs full and has room again: told on the page and everywhere else, and healed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from playwright.sync_api import expect

from tests.browser.hmi import Hmi, OpenPage
from tests.support.domains import ros_env
from tests.support.live import attached
from tests.support.messages import scan
from tests.support.processes import OFTEN, Process
from tests.support.ros import Peer
from tests.support.small_disk import SmallDisk
from tests.support.web import Bridge

TOLD = "/lupin_twin: journal"


@contextmanager
def serving(domain: int, disk: SmallDisk) -> Iterator[Bridge]:
    """`lupin-twin serve` with its journal on a small disk."""
    words = [sys.executable, "-m", "lupin_bridge.cli.command", "serve", "--port", "0", *OFTEN]
    journal = ["-p", f"journal:={disk.folder / 'j.sqlite'}"]
    command = disk.command(*words, *journal)
    with Process(command, ros_env(domain)) as process, Peer(domain) as peer:
        disk.pid = process.pid
        with attached(process, peer) as live:
            yield live


def metrics(live: Bridge) -> dict[str, float]:
    lines = (line.split() for line in live.get("/metrics").text.splitlines() if line[0] != "#")
    return {words[0]: float(words[1]) for words in lines if words[0].startswith("lupin_journal")}


def journal(live: Bridge) -> Any:
    return live.json("/readyz")["journal"]


def test_a_full_disk_is_told_everywhere_costs_nothing_and_heals(
    domain: int, tmp_path: Path, open_page: OpenPage
) -> None:
    disk = SmallDisk(tmp_path / "disk")
    disk.folder.mkdir()
    print("a file system of its own" if disk.is_real else "a limit on the size of files")
    with serving(domain, disk) as live:
        said: list[DiagnosticArray] = []
        live.peer.node.create_subscription(DiagnosticArray, "/diagnostics", said.append, 10)
        number = 0

        def observed() -> None:
            nonlocal number
            for _ in range(20):
                number += 1
                live.peer.observe(scan(f"{number % 30}", {"co2": float(number)}))
            live.tag(f"{number % 30}", lambda tag: tag["readings"][0]["value"] == number)

        def levels() -> dict[str, bytes]:
            last = said[-1].status if said else ()
            return {status.name: status.level for status in last}

        observed()
        hmi: Hmi = open_page(live.url)
        # Of a past that is not to be had the page is told so.
        hmi.allow_noise(r"503 .*/api/(state|health|timeline)\?")
        hmi.expect(lambda: journal(live)["state"] == "recording", "a journal")
        troubles = hmi.test_id("troubles")
        expect(troubles).to_be_empty()

        def is_full() -> bool:
            # What the journal gives back as it closes its file is soon taken.
            disk.fill()
            observed()
            return str(journal(live)["state"]) == "failing"

        hmi.expect(is_full, "a full disk")
        hmi.expect(
            lambda: is_full() and "cannot be written" in journal(live)["detail"], "what it is told"
        )
        hmi.expect(
            lambda: (
                is_full()
                and (told := metrics(live))["lupin_journal_recording"] == 0
                and told["lupin_journal_rows_waiting"] > 0
            ),
            "the same in the metrics",
        )
        words = ("Nothing is being recorded.", "Free disk space, or check the disk")
        hmi.expect(
            lambda: is_full() and all(word in troubles.inner_text() for word in words), "the page"
        )
        live.peer.until(
            lambda: is_full() and levels().get(TOLD) == DiagnosticStatus.ERROR, "an error"
        )
        # The twin goes on, and so does the page.
        hmi.expect_phase("live")
        observed()

        disk.free()
        hmi.expect(lambda: journal(live)["state"] == "recording", "a journal that has healed")
        expect(troubles).to_be_empty()
        hmi.expect(lambda: metrics(live)["lupin_journal_rows_waiting"] == 0, "all of it written")
        told = metrics(live)
        assert told["lupin_journal_rows_lost_total"] == 0
        assert told["lupin_journal_rows_total"] >= number
        live.peer.until(lambda: levels().get(TOLD) == DiagnosticStatus.OK, "no error")
        live.process.wait_for_output("journal: well again: recording")
