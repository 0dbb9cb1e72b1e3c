"""What is forked is as what was started."""

from __future__ import annotations

import os
import select
import signal
import sys
import tempfile
from collections.abc import Iterator

import pytest

from tests.support.domains import ros_env
from tests.support.processes import OFTEN, Process
from tests.support.template import Template
from tests.support.waiting import PATIENCE_S, wait_for

TWIN = (sys.executable, "-m", "lupin_twin.cli", *OFTEN)
MISTAKEN = (sys.executable, "-m", "lupin_bridge.cli.command", "serve", "--port", "x")


@pytest.fixture(scope="module")
def template() -> Iterator[Template]:
    """It has imported next to nothing, and is there the sooner."""
    template = Template(imported=())
    yield template
    template.end()


def test_it_ends_with_its_own_code_and_words(template: Template) -> None:
    said = []
    with Process(MISTAKEN, ros_env(0), afresh=True) as process, tempfile.TemporaryFile("w+") as out:
        forked = template.start(MISTAKEN, {**os.environ, "COLUMNS": "80"}, out)
        assert forked.wait(PATIENCE_S) == process.wait() == 2
        assert forked.poll() == 2
        out.seek(0)
        said = out.read().splitlines()
        assert said[-1] == process.output.splitlines()[-1]
    assert "'x': input should be a valid integer" in said[-1]


def test_it_is_a_process_of_its_own(template: Template, domain: int) -> None:
    with tempfile.TemporaryFile("w+") as out:
        forked = template.start(TWIN, ros_env(domain), out)
        assert os.getsid(forked.pid) == os.getpgid(forked.pid) == forked.pid
        wait_for(lambda: says(out.fileno(), f"ROS domain {domain} "), "its domain")
        assert forked.poll() is None
        forked.send_signal(signal.SIGINT)
        assert forked.wait(PATIENCE_S) == 0
        forked.send_signal(signal.SIGINT)  # to nobody


def test_a_signal_that_ends_it_is_its_code(template: Template) -> None:
    with tempfile.TemporaryFile("w+") as out:
        forked = template.start(TWIN, os.environ, out)
        forked.send_signal(signal.SIGKILL)
        assert forked.wait(PATIENCE_S) == -signal.SIGKILL


def test_what_is_read_as_it_is_imported_has_to_be_the_same(template: Template) -> None:
    env = dict(os.environ)
    assert template.can_be(TWIN, {**env, "ROS_DOMAIN_ID": "7", "LUPIN_PORT": "0"})
    assert not template.can_be(TWIN, {**env, "OPENBLAS_NUM_THREADS": "2"})
    assert not template.can_be(TWIN, {k: env[k] for k in env if k != "ROS_PYTHON_CHECK_FIELDS"})
    assert not template.can_be((sys.executable, "-m", "http.server"), env)
    assert not template.can_be((sys.executable, "-X", "dev", *TWIN[1:]), env)


def test_with_it_all_that_it_has_started_ends_and_that_is_told() -> None:
    template = Template(imported=())
    with tempfile.TemporaryFile("w+") as out:
        forked = template.start(TWIN, ros_env(0), out)
        end = os.pidfd_open(forked.pid)
        os.kill(template.pid, signal.SIGKILL)
        assert select.select([end], [], [], PATIENCE_S)[0], "it goes on"
        os.close(end)
        with pytest.raises(RuntimeError, match="the process that is forked has died"):
            forked.poll()
    template.end()


def says(descriptor: int, text: str) -> bool:
    return text in os.pread(descriptor, 10_000, 0).decode()
