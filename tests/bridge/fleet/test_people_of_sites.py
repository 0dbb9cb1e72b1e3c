"""Accounts and tokens for some sites of a fleet: they read those, and learn of no other."""

from pathlib import Path

import pytest

from lupin_bridge.access.accounts import digest
from tests.support.access import served
from tests.support.archive import Archive, forward_once
from tests.support.fleet import Page, fleet, scans_lately, write
from tests.support.people import TOKEN, changing
from tests.support.waiting import wait_for
from tests.support.ws_client import open_websocket

OURS = {"Authorization": f"Bearer {TOKEN}"}
ALL = {"Authorization": f"Bearer all-{TOKEN}"}


@pytest.fixture
def accounts(tmp_path: Path) -> Path:
    path = tmp_path / "accounts.sqlite"
    with changing(path) as file:
        for name, secret, sites in (("ours", TOKEN, ["gh1"]), ("all", f"all-{TOKEN}", [])):
            file.add(name, "token", "viewer", digest(secret), by="a test", now_s=1, sites=sites)
    return path


def test_who_is_for_one_site_sees_that_one_alone_by_every_way(
    archive: Archive, tmp_path: Path, accounts: Path
) -> None:
    for site in ("gh1", "gh2"):
        write(tmp_path / f"{site}.sqlite", scans_lately(temperature=45.0))
        forward_once(archive.of_site(site), tmp_path / f"{site}.sqlite")
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


def test_a_bridge_of_another_site_or_of_none_that_is_named_lets_them_do_nothing(
    accounts: Path,
) -> None:
    with served("--accounts", str(accounts)) as live:
        wait_for(lambda: live.get("/api/state", ALL).status_code == 200, "the state")
        answer = live.get("/api/state", OURS)
        assert (answer.status_code, "this bridge has no --site" in answer.text) == (403, True)
        assert live.handshake(headers=OURS) == 403
        assert live.get("/api/session", OURS).json()["name"] == "ours"
