"""A process that has imported the programs already, and forks for each start in a test.

Starting `serve` takes 1.2 s of a core, of which all but 0.1 s is importing and loading: the same
modules, hundreds of times. Each pytest worker has one template, from the first start on. It has
imported and done nothing else: no thread of ours, no ROS context. A fork is a process as from
`Popen`: a session, an environment, arguments and an output of its own, and a pid that stays its
own until it was waited for. It ends with the template, and that with the worker, however they end.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import inspect
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import IO, Any, Final

# The programs that it can become, by the module for `python -m`.
PROGRAMS: Final = (
    "lupin_bridge.cli.command",
    "lupin_twin.cli",
    "lupin_patrol",
    "tests.support.limited",
    "tests.support.upgrade_child",
)
# What they import while they run.
IMPORTED: Final = (
    "lupin_bridge.cli.roles",
    "lupin_twin.ros.node",
    "lupin_twin.ros.parameters",
    "lupin_twin.ros.base_node",
    "lupin_bridge.feed.local",
    "lupin_bridge.feed.web",
    "lupin_patrol.mission",
    "lupin_patrol.node",
    "greenhouse_sim.simulator",
    "psycopg",
    "lupin_bridge.judge.sensors_file",
    "rosidl_generator_py",
    "uvicorn.lifespan.on",
)
# Variables that a running program reads, in our code or in rcl. Others may be read during imports:
# when one of them differs, a process has to start anew.
_READ_LATE: Final = (
    "FASTDDS_",
    "FASTRTPS_",
    "LUPIN_",
    "PGPASSWORD",
    "PYTEST_",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DOMAIN_ID",
    "ROS_LOG_DIR",
    "SSL_CERT_FILE",
    "TMPDIR",
    "XDG_STATE_HOME",
)
_MOST_BYTES: Final = 200_000  # the largest message on a socket, Linux's wmem_default
_PR_SET_PDEATHSIG: Final = 1


class Template:
    """The worker's end: starts processes, and returns their exit codes."""

    def __init__(self, imported: Sequence[str] = IMPORTED) -> None:
        self._env = dict(os.environ)
        self._folder = Path.cwd()
        self._output = tempfile.TemporaryFile("w+")  # noqa: SIM115  # as long as the worker
        self._lock = threading.Lock()
        self._link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(theirs.fileno()), *imported],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=self._output,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )
        atexit.register(self.end)

    def can_be(self, command: Sequence[str], env: Mapping[str, str]) -> bool:
        """Whether a fork can replace this command in this environment."""
        if list(command[:2]) != [sys.executable, "-m"] or command[2] not in PROGRAMS:
            return False
        differing = {name for name, _ in self._env.items() ^ env.items()}
        late = all(name.startswith(_READ_LATE) for name in differing)
        return late and Path.cwd() == self._folder

    def start(self, command: Sequence[str], env: Mapping[str, str], *outputs: IO[str]) -> Forked:
        """A process that runs this command; its outputs are one file, or one per stream."""
        program, *arguments = command[2:]
        request = {"program": program, "arguments": arguments, "env": dict(env)}
        return Forked(
            command, self._request(request, [output.fileno() for output in outputs]), self._request
        )

    @property
    def pid(self) -> int:
        return self._process.pid

    def end(self) -> None:
        self._link.close()
        self._process.wait()
        self._output.close()

    def _request(self, request: Mapping[str, Any], files: Sequence[int] = ()) -> int:
        with self._lock:
            try:
                socket.send_fds(self._link, [json.dumps(request).encode()], files)
                answer = self._link.recv(_MOST_BYTES)
            except OSError as error:
                answer, why = b"", str(error)
            else:
                why = "it says no more"
        if not answer:
            self._output.seek(0)
            raise RuntimeError(f"the process that is forked has died: {why}\n{self._output.read()}")
        return int(answer)


class Forked:
    """The part of `subprocess.Popen` that tests need."""

    def __init__(self, args: Sequence[str], pid: int, query: Callable[[Mapping[str, Any]], int]):
        self.args, self.pid, self._request = args, pid, query
        self._lock = threading.Lock()
        self._ended: int | None = None
        self._handle = os.pidfd_open(pid)  # it exists until `_request` has fetched its end

    def poll(self) -> int | None:
        """Its exit code, as from `Popen`, once it has ended."""
        return self._poll(0.0)

    def wait(self, timeout_s: float | None = None) -> int:
        code = self._poll(timeout_s)
        if code is None:
            raise subprocess.TimeoutExpired(self.args, timeout_s or 0.0)
        return code

    def send_signal(self, number: signal.Signals) -> None:
        """Send it a signal, unless it has ended."""
        if self.poll() is None:
            signal.pidfd_send_signal(self._handle, number)

    def _poll(self, timeout_s: float | None) -> int | None:
        if self._ended is None:
            poll = select.poll()
            poll.register(self._handle, select.POLLIN)
            if poll.poll(None if timeout_s is None else timeout_s * 1_000):
                with self._lock:  # a second request for one end would end the template
                    if self._ended is None:
                        self._ended = self._request({"ended": self.pid})
                        os.close(self._handle)
        return self._ended


def _serve(link: socket.socket) -> Mapping[str, Any] | None:
    """Answer the worker until it has gone; in a forked process: what that has to become."""
    while True:
        message, files, _, _ = socket.recv_fds(link, _MOST_BYTES, 2)
        if not message:
            return None
        request = json.loads(message)
        if "ended" in request:
            link.send(b"%d" % os.waitstatus_to_exitcode(os.waitpid(request["ended"], 0)[1]))
        elif os.fork() == 0:
            os.setsid()
            os.dup2(files[0], sys.stdout.fileno())
            os.dup2(files[-1], sys.stderr.fileno())
            link.send(b"%d" % os.getpid())
            link.close()
            _close(files)
            return dict(request)
        else:
            _close(files)


def _close(files: Sequence[int]) -> None:
    for file in files:
        os.close(file)


def _know_of_forks() -> None:
    """Register forks with LTTng, whose threads trace ROS: otherwise a child crashes at its end.

    As its own liblttng-ust-fork does; the names are those up to LTTng 2.12, and from 2.13 on.
    """
    mask = ctypes.create_string_buffer(128)  # a sigset_t, glibc
    maps = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    paths = {line.split()[-1] for line in maps if "/liblttng-ust" in line}
    for library in map(ctypes.CDLL, paths):
        for name in ("ust_{}_fork{}", "lttng_ust_{}_fork{}"):
            if hasattr(library, name.format("before", "")):
                calls = [("before", ""), ("after", "_parent"), ("after", "_child")]
                before, parent, child = (
                    partial(getattr(library, name.format(*call)), mask) for call in calls
                )
                os.register_at_fork(before=before, after_in_parent=parent, after_in_child=child)


def _know_messages() -> None:
    """Load what the first message of each package would load."""
    from diagnostic_msgs.msg import DiagnosticArray
    from lupin_msgs.msg import Observation
    from nav_msgs.msg import OccupancyGrid
    from rcl_interfaces.msg import ParameterEvent
    from rclpy.type_support import check_for_type_support
    from visualization_msgs.msg import MarkerArray

    for message in (DiagnosticArray, Observation, OccupancyGrid, ParameterEvent, MarkerArray):
        check_for_type_support(message)


def main() -> None:
    """Import everything, and fork."""
    for name in (*PROGRAMS, *sys.argv[2:]):
        import_module(name)
    _know_messages()
    inspect.getmodule(inspect.currentframe())  # where rclpy's logger finds its caller
    _know_of_forks()
    gc.collect()
    gc.freeze()
    template = os.getpid()
    request = _serve(socket.socket(fileno=int(sys.argv[1])))
    if request is None:
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != template:  # it has died before
        return
    os.environ.clear()
    os.environ.update(request["env"])
    program = import_module(request["program"])
    sys.argv = [str(program.__file__), *request["arguments"]]
    if hasattr(program, "command"):
        program.command()
    import_module(f"{request['program']}.__main__")


if __name__ == "__main__":
    main()
