"""A note from the fleet's page is a row of the site's log, on every replica."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest

from lupin_bridge.access.credentials import digest
from lupin_bridge.archive.forwarding import Forwarder
from lupin_twin.core.notes import Note
from tests.support.access import served
from tests.support.archive import Archive, forward_once, rows_of
from tests.support.fleet import Page, fleet, forward, recent_scans
from tests.support.people import OWN, TOKEN, add, changing, signed_in
from tests.support.waiting import wait_for
from tests.support.ws_client import open_websocket

ALARMS = "/sites/gh1/api/alarms"
NOTES = "/sites/gh1/api/notes"


@dataclass
class Here:
    page: Page
    archive: Archive
    accounts: Path
    journal: Path


@pytest.fixture(scope="module")
def here(shared_archive: Archive, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Here]:
    archive, folder = shared_archive, tmp_path_factory.mktemp("notes")
    accounts, journal = folder / "accounts.sqlite", folder / "journal.sqlite"
    add(accounts, anna="operator", vera="viewer")
    forward(archive, journal, recent_scans(temperature=45.0, tags=1))
    with fleet(archive, "--accounts", str(accounts)) as page:
        yield Here(page, archive, accounts, journal)


def alarm_of(browser: httpx.Client, **message: str) -> dict[str, Any]:
    """The alarm of the hot tag, once it has this note."""

    def check() -> dict[str, Any] | None:
        answer = browser.get(ALARMS)
        every = answer.json()["alarms"] if answer.status_code == 200 else []
        return next((it for it in every if it["tag_id"] and message.items() <= it.items()), None)

    found = wait_for(check, f"an alarm with {message}")
    assert found is not None
    return found


def post(browser: httpx.Client, **note: Any) -> httpx.Response:
    return browser.post(NOTES, json=note)


def test_an_acknowledged_alarm_is_shown_by_every_replica(here: Here) -> None:
    archive = here.archive
    with (
        fleet(archive, "--accounts", str(here.accounts)) as other,
        signed_in(here.page.url, "anna") as anna,
        signed_in(other.url, "vera") as vera,
    ):
        alarm = alarm_of(anna)
        assert anna.get("/sites/gh1/api/session").json()["can_write_notes"]
        answer = post(anna, kind="acknowledge", subject=f"alarm:{alarm['id']}", text="fan")
        assert answer.status_code == 201, answer.text
        note = answer.json()
        ((*row,),) = archive.select("SELECT site, id, made_by, kind, subject, text FROM note")
        subject = f"alarm:{alarm['id']}"
        assert row == ["gh1", note["id"], "anna", "acknowledge", subject, "fan"]
        shown = alarm_of(vera, acknowledged_by="anna")
        assert shown["acknowledged_at"] == note["made_at"]
        assert vera.get(NOTES).json() == {"notes": [note]}

        def overview() -> bool:
            every = vera.get("/api/alarms").json()["alarms"]
            return any(it.get("acknowledged_by") == "anna" for it in every)

        wait_for(overview, "the word beside the alarm of all sites")
        # A withdrawn note stays stored.
        assert anna.delete(f"{NOTES}/{note['id']}").status_code == 200
        wait_for(lambda: "acknowledged_by" not in alarm_of(vera), "the alarm as before")
        kinds = archive.select("SELECT kind FROM note ORDER BY made_at_ns")
        assert kinds == [("acknowledge",), ("withdraw",)]
        # A later row of the journal changes none of it.
        forward_once(archive, here.journal)
        assert archive.select("SELECT kind FROM note ORDER BY made_at_ns") == kinds
        assert rows_of(here.journal)["note"] == []


def test_what_people_wrote_comes_back_and_nothing_else(here: Here) -> None:
    archive, now_ns = here.archive, time.time_ns()
    with signed_in(here.page.url, "anna") as anna:
        before = archive.select("SELECT id FROM note")
        # Of an earlier journal with far more rows, of no kind, too long, and for a century.
        values = (
            (2**40, "comment", "site", "x", None),
            (1, "k" * 100_000, "site", "x", None),
            (1, "comment", "site", "x" * 5_000, None),
            (1, "shelve", "alarm:a", "x", now_ns + 100 * 365 * 86_400 * 10**9),
        )
        for n, (number, kind, subject, text, until_ns) in enumerate(values):
            until = "NULL" if until_ns is None else until_ns
            archive.do(
                f"INSERT INTO note VALUES ('gh1', '{number:016x}{n:08x}', {now_ns}, 'eve',"
                f" '{kind}', '{subject}', '{text}', {until})"
            )
        alarm_of(anna)
        note = post(anna, kind="comment", subject="site", text="vents checked").json()
        given = list[Note]()
        journal, url = here.journal, archive.url()
        assert Forwarder(url, "gh1", lambda: journal, print, given.append).run(once=True)
        assert sorted(it.id for it in given) == sorted([note["id"], *(it for (it,) in before)])
        archive.do("DELETE FROM note WHERE made_by = 'eve'")


def test_a_person_without_the_right_is_refused(here: Here) -> None:
    page, written = here.page, here.archive.select("SELECT count(*) FROM note")
    with signed_in(page.url, "vera") as vera, signed_in(page.url, "anna") as anna:
        subject = f"alarm:{alarm_of(vera)['id']}"
        assert post(vera, kind="acknowledge", subject=subject).status_code == 403
        assert not vera.get("/sites/gh1/api/session").json()["can_write_notes"]
        nobody = httpx.post(
            page.url + NOTES, json={"kind": "comment"}, headers=OWN, trust_env=False
        )
        assert nobody.status_code == 401
        # As a page elsewhere would, with the browser's cookie and no header of its own.
        forged = anna.build_request("POST", NOTES, json={"kind": "comment"})
        del forged.headers["X-Lupin-Twin"]
        assert anna.send(forged).status_code == 403
        other = anna.post("/sites/other/api/notes", json={"kind": "comment"})
        assert other.status_code == 404
        # Notes belong to a site; the fleet has no others.
        for path in ("/api/notes", "/sites/gh1/", "/sites/gh1/api/state", "/api/sites"):
            assert anna.post(path, json={}).status_code in {404, 405, 413}, path
        assert here.archive.select("SELECT count(*) FROM note") == written
        for path in ("/sites/gh1/", "/sites/gh1", "/sites/none/", "/sites/gh1/api/state"):
            headers = vera.get(path).headers
            assert headers["x-frame-options"] == "DENY", path
            assert "frame-ancestors" in headers["content-security-policy"], path


def test_an_archive_that_cannot_be_written_is_reported(here: Here) -> None:
    archive = here.archive
    with signed_in(here.page.url, "anna") as anna:
        alarm_of(anna)
        archive.do("REVOKE INSERT ON note FROM lupin_page")
        begun_s = time.monotonic()
        answer = post(anna, kind="comment", subject="site", text="vents checked")
        assert answer.status_code == 503, answer.text
        assert "was not written" in answer.json()["detail"]
        assert time.monotonic() - begun_s < 60
        archive.do("GRANT INSERT ON note TO lupin_page")
        assert post(anna, kind="comment", subject="site", text="vents checked").status_code == 201
        with psycopg.connect(archive.owner) as holder:
            holder.execute("LOCK note IN SHARE MODE")
            answer = post(anna, kind="comment", subject="site", text="who waits")
            assert (answer.status_code, "takes too long" in answer.text) == (503, True), answer.text
        assert archive.select("SELECT 1 FROM note WHERE text = 'who waits'") == []


OURS = {"Authorization": f"Bearer {TOKEN}"}
ALL = {"Authorization": f"Bearer all-{TOKEN}"}


@pytest.fixture
def accounts(tmp_path: Path) -> Path:
    path = tmp_path / "accounts.sqlite"
    with changing(path) as file:
        for name, secret, sites in (("ours", TOKEN, ["gh1"]), ("all", f"all-{TOKEN}", [])):
            file.add(name, "token", "viewer", digest(secret), by="a test", now_s=1, sites=sites)
    return path


def test_a_person_of_one_site_sees_that_site_alone_on_every_route(
    archive: Archive, tmp_path: Path, accounts: Path
) -> None:
    for site in ("gh1", "gh2"):
        forward(archive.of_site(site), tmp_path / f"{site}.sqlite", recent_scans(temperature=45.0))
    archive.keep_live()
    with fleet(archive, "--accounts", str(accounts)) as page:
        page.http.headers.update(ALL)
        page.site("gh1", active_alarms=5)
        page.site("gh2", active_alarms=5)
        assert names(page, ALL) == {"gh1", "gh2"}
        assert names(page, OURS) == {"gh1"}
        alarms = page.http.get("/api/alarms", headers=OURS).json()
        assert ({it["site"] for it in alarms["alarms"]}, alarms["total"]) == ({"gh1"}, 5)
        report = page.http.get("/api/report", headers=OURS).json()
        assert [row["site"] for row in report["sites"]] == ["gh1"]
        compared = page.http.get("/api/compare?sensor_type=temperature", headers=OURS)
        rows = page.http.get("/api/export.csv", headers=OURS).text
        for text in (compared.text, rows):
            assert "gh1" in text
            assert "gh2" not in text
        for path in (
            *("/sites/gh2/", "/sites/gh2/api/state", "/sites/gh2/api/alarms", "/sites/gh2"),
            *("/api/sites/gh2/map.svg", "/sites/%67h2/api/state"),
        ):
            answer = page.http.get(path, headers=OURS)
            assert (answer.status_code, "ours is for gh1" in answer.text) == (403, True), path
            assert page.http.get(path, headers=ALL).status_code in (200, 307), path
        for path in ("/api/alarms", "/api/report", "/api/compare?sensor_type=temperature"):
            mark = "&" if "?" in path else "?"
            answer = page.http.get(f"{path}{mark}sites=gh1,gh2", headers=OURS)
            assert answer.status_code == 404, answer.text
        assert page.http.get("/api/export.csv?sites=gh2", headers=OURS).status_code == 404
        assert page.http.get("/sites/gh1/api/state", headers=OURS).status_code == 200
        assert page.http.get("/api/session", headers=OURS).json()["name"] == "ours"
        ws = page.url.replace("http", "ws", 1)
        with open_websocket(f"{ws}/ws/sites", additional_headers=OURS) as overview:
            for _ in range(2):
                frame = str(overview.recv())
                assert "gh2" not in frame


def names(page: Page, headers: dict[str, str]) -> set[str]:
    return {it["site"] for it in page.http.get("/api/sites", headers=headers).json()["sites"]}


def test_on_a_bridge_of_another_or_an_unnamed_site_they_may_do_nothing(accounts: Path) -> None:
    with served("--accounts", str(accounts)) as live:
        wait_for(lambda: live.get("/api/state", ALL).status_code == 200, "the state")
        answer = live.get("/api/state", OURS)
        assert (answer.status_code, "this bridge has no --site" in answer.text) == (403, True)
        assert live.handshake(headers=OURS) == 403
        assert live.get("/api/session", OURS).json()["name"] == "ours"
