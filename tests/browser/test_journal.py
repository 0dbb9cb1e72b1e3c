"""A disk that runs full and has room again: told on the page and everywhere else, and healed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from playwright.sync_api import expect

from tests.browser.hmi import Hmi, OpenPage
from tests.support.disk import Disk, build
from tests.support.messages import scan
from tests.support.processes import OFTEN
from tests.support.web import Bridge, bridge

TOLD = "/lupin_twin: journal"


def metrics(live: Bridge) -> dict[str, float]:
    lines = (line.split() for line in live.get("/metrics").text.splitlines() if line[0] != "#")
    return {words[0]: float(words[1]) for words in lines if words[0].startswith("lupin_journal")}


def journal(live: Bridge) -> Any:
    return live.json("/readyz")["journal"]


def test_a_full_disk_is_told_everywhere_costs_nothing_and_heals(
    domain: int, tmp_path: Path, open_page: OpenPage
) -> None:
    folder = tmp_path / "disk"
    folder.mkdir()
    disk = Disk(folder, build(tmp_path), tmp_path / "control")
    options = (*OFTEN, "-p", f"journal:={folder / 'j.sqlite'}")
    with bridge(*options, domain=domain, afresh=True, **disk.env) as live:
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

        disk.be("full")
        observed()
        hmi.expect(lambda: journal(live)["state"] == "failing", "a full disk")
        hmi.expect(lambda: "cannot be written" in journal(live)["detail"], "what it is told")
        hmi.expect(
            lambda: (
                (told := metrics(live))["lupin_journal_recording"] == 0
                and told["lupin_journal_rows_waiting"] > 0
            ),
            "the same in the metrics",
        )
        expect(troubles).to_contain_text("Recording has failed.")
        expect(troubles).to_contain_text("Free disk space, or check the disk")
        live.peer.until(lambda: levels().get(TOLD) == DiagnosticStatus.ERROR, "an error")
        # The twin goes on, and so does the page.
        hmi.expect_phase("live")
        observed()

        disk.be("well")
        hmi.expect(lambda: journal(live)["state"] == "recording", "a journal that has healed")
        expect(troubles).to_be_empty()
        hmi.expect(lambda: metrics(live)["lupin_journal_rows_waiting"] == 0, "all of it written")
        told = metrics(live)
        assert told["lupin_journal_rows_lost_total"] == 0
        assert told["lupin_journal_rows_total"] >= number
        live.peer.until(lambda: levels().get(TOLD) == DiagnosticStatus.OK, "no error")
        live.process.wait_for_output("journal: well again: recording")
