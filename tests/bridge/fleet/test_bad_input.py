"""What is wrong is said in one line."""

import asyncio
import subprocess
import sys

import psycopg
import pytest

from lupin_bridge.access.middleware import Access
from lupin_bridge.access.policy import Proxies
from lupin_bridge.fleet import source
from lupin_bridge.fleet.app import Fleet, create_fleet_app
from lupin_bridge.fleet.source import Watching
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.serving.admission import Limits
from lupin_bridge.settings import Settings
from tests.support.archive import Archive, run
from tests.support.fleet import fleet
from tests.support.waiting import wait_for
from tests.test_docs import FLEET_ROUTES


@pytest.mark.parametrize(
    ("args", "said"),
    [
        ((), "--archive-url is missing, or LUPIN_ARCHIVE_URL"),
        (("--archive-url", "nonsense"), "--archive-url is no address of a PostgreSQL"),
        (
            ("--archive-url", "postgresql://a@b/c", "--site", "gh1"),
            "--site is for a twin, not for lupin-twin fleet",
        ),
        (
            ("--archive-url", "postgresql://a@b/c", "--ros-args", "-p", "a:=1"),
            "fleet takes no arguments of ROS",
        ),
    ],
)
def test_what_can_never_work_ends_it(args: tuple[str, ...], said: str) -> None:
    done = run("fleet", "--port", "0", *args)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert said in done.stderr


def test_what_may_pass_is_said_and_the_page_is_served(archive: Archive) -> None:
    archive.do("UPDATE archive SET version = 99")
    with fleet(archive) as page:
        page.process.wait_for_output("the archive is of version 99")
        answer = page.http.get("/readyz")
        assert answer.status_code == 503
        wait_for(
            lambda: "version 99" in page.http.get("/readyz").json()["message"], "the reason there"
        )
        assert page.sites() == {}
        archive.do("UPDATE archive SET version = 1")
        wait_for(lambda: page.http.get("/readyz").status_code == 200, "an archive that is read")
        assert page.sites() == {}, "an archive without sites is an empty overview"
        metrics = page.http.get("/metrics").text
        assert "lupin_fleet_archive_reachable 1" in metrics
        assert "lupin_fleet_sites 0" in metrics
        for path in ("/sites/gh9/", "/sites/gh9", "/sites/gh9/api/state", "/sites/", "/nonsense"):
            answer = page.http.get(path)
            assert answer.status_code == 404, path
        assert "no site 'gh9'" in page.http.get("/sites/gh9/").json()["detail"]
        for method in ("POST", "PUT", "DELETE"):
            assert page.http.request(method, "/api/sites").status_code == 405
        answer = page.http.get("/api/sites", headers={"Origin": "https://evil.example"})
        assert answer.status_code == 403


def test_a_database_without_an_archive(archive: Archive) -> None:
    with psycopg.connect(archive.server.url, autocommit=True) as connection:
        connection.execute("CREATE DATABASE bare")
    archive.name = "bare"
    with fleet(archive) as page:
        page.process.wait_for_output("lupin-twin archive init makes it")


def test_an_archive_that_answers_late_and_badly_is_said_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []

    async def run_against_it() -> None:
        made, tried = Watching(Settings(), lambda: said.append(made.archive.message)), 0
        is_over = asyncio.Event()

        async def hang_up(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            nonlocal tried
            await asyncio.sleep(1.0)  # longer than it is waited for
            writer.close()
            tried += 1
            if tried == 2:
                is_over.set()

        async with await asyncio.start_server(hang_up, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            monkeypatch.setenv("LUPIN_ARCHIVE_URL", f"postgresql://a@127.0.0.1:{port}/b")
            made.start()
            await is_over.wait()
            await made.stop()

    monkeypatch.setattr(source, "_START_S", 0.5)
    asyncio.run(run_against_it())
    assert len(said) == 2, said
    assert "has not answered" in said[0]
    assert "server closed the connection" in said[1]


def test_the_overviews_routes_are_those_of_the_docs() -> None:
    settings = Settings()
    made = Fleet(settings, Criteria.of(settings), Access(), Limits())
    app = create_fleet_app(made, Access(), Proxies())
    paths = {getattr(route, "path", "") for route in app.routes}
    assert paths >= FLEET_ROUTES


def test_a_fleet_is_shown_without_ros() -> None:
    code = "import sys, lupin_bridge.cli.roles; print('rclpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
