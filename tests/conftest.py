"""Fixtures for all tests."""

from __future__ import annotations

import asyncio
import gc
import inspect
import os
import ssl
import tempfile
from collections.abc import Iterator
from functools import partialmethod
from pathlib import Path
from typing import TYPE_CHECKING, cast

import httpx
import pytest
from hypothesis import HealthCheck, settings

from tests.support.domains import own_domain, remove_what_the_dead_left
from tests.support.needs import let_nothing_in
from tests.support.state_home import use_own

if TYPE_CHECKING:
    from tests.support.archive import Archive
    from tests.support.postgres import Postgres

# Twins store files in a user's folder; those of the tests use another, in every process.
STATE = use_own()

# At any hour: for servers without light sensors, which go by their clock.
os.environ["LUPIN_DAY_HOURS"] = "00:00-00:00"
# Before anything imports rclpy: otherwise ROS ignores a field of the wrong type, and may crash.
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
# Before numpy: its own threads waiting for a busy core take ten times the time.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
# Fast DDS 2.14 may crash in `destroy_node`, over the mutex of a removed port of shared memory.
# The tests' own nodes have no such port; the processes that they start do (`domains.ros_env`).
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SYSTEM_DEFAULT"  # as in the file; LOCALHOST adds one
os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(Path(__file__).with_name("support") / "dds.xml")

# A client reads all root certificates, 24 ms each time; on loopback none is needed.
_NOBODY = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
for client in (httpx.Client, httpx.AsyncClient):
    client.__init__ = partialmethod(client.__init__, verify=_NOBODY)  # type: ignore[assignment,method-assign]

# How long an example takes depends on the machine.
settings.register_profile("here", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("here")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--quick", action="store_true", help="only tests that need neither ROS nor a browser"
    )


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--quick"):
        let_nothing_in()


def pytest_collection_finish() -> None:
    """Freeze the objects of collection: no `gc.collect()` has to traverse them."""
    gc.freeze()


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Clean the machine's memory: many tests kill processes."""
    if not hasattr(session.config, "workerinput"):  # once, not by each worker
        remove_what_the_dead_left()


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a coroutine in its own loop; with `domain`, its nodes are in that ROS domain."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    names = inspect.signature(pyfuncitem.obj).parameters
    test = pyfuncitem.obj(**{name: pyfuncitem.funcargs[name] for name in names})
    if "domain" in pyfuncitem.funcargs:
        from tests.support.inprocess import run  # has ROS

        run(cast("int", pyfuncitem.funcargs["domain"]), test)
    else:
        asyncio.run(test)
    return True


@pytest.fixture(autouse=True)
def state(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", tempfile.mkdtemp(dir=STATE))


@pytest.fixture
def domain() -> Iterator[int]:
    with own_domain() as leased:
        yield leased


@pytest.fixture(scope="session")
def postgresql() -> Iterator[Postgres]:
    """A PostgreSQL for all tests of a worker that leave the server as it is."""
    from tests.support.postgres import server

    with server() as made:
        yield made


def _archive(postgresql: Postgres) -> Iterator[Archive]:
    from tests.support.archive import Archive

    made = Archive(postgresql)
    made.add_user("page", "lupin_page")
    yield made
    made.drop()


@pytest.fixture
def archive(postgresql: Postgres) -> Iterator[Archive]:
    """A new archive, with the user of the site gh1, and one that may read everything."""
    yield from _archive(postgresql)


@pytest.fixture(scope="module")
def shared_archive(postgresql: Postgres) -> Iterator[Archive]:
    """The same, for the tests of a module together."""
    yield from _archive(postgresql)


@pytest.fixture
def children_know_the_tests() -> Iterator[None]:
    """Our Python children do not look for modules in their folder (`-P`), nor here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parents[1]), prepend=os.pathsep)
        yield
