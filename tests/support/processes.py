"""Real processes: started, watched, and removed without a trace."""

import contextlib
import io
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from tests.support.domains import ros_env
from tests.support.template import Forked, Template
from tests.support.waiting import PATIENCE_S, wait_for

# ROS arguments, last on a command line: states so often that no test waits for one, and that a
# busy machine causes no silence.
OFTEN = ("--ros-args", "-p", "state_publish_rate_hz:=20.0")

# A shell that runs the tests in the background makes them ignore SIGINT, with all child processes
# until they set a handler: an earlier signal would be lost.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


class Process:
    """A process with its output in a file; killed with all its children at the end of `with`.

    Within pytest, and unless `afresh`, one of our programs is forked from a process that has
    imported it already (`Template`). A test that measures a process (memory, the time of its
    start, a signal during it) starts it afresh.
    """

    def __init__(
        self, command: Sequence[str], env: Mapping[str, str], *, afresh: bool = False
    ) -> None:
        self._output = tempfile.NamedTemporaryFile("w+", suffix=".log", delete=False)  # noqa: SIM115
        env = {**env, **_state_of_its_own(env)}
        self._process: subprocess.Popen[bytes] | Forked
        if not afresh and _can_be_forked(command, env):
            self._process = _template().start(command, env, self._output)
            return
        self._process = subprocess.Popen(
            command,
            env=env,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        self.kill()
        if error is not None:
            print(f"--- output of {self._process.args!r}\n{self.output}")
        self._output.close()
        Path(self._output.name).unlink()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def output(self) -> str:
        """All that it has printed so far, both streams, without Fast DDS's messages about ports.

        When two processes open one port of shared memory at once, it logs that and tries again.
        """
        text = Path(self._output.name).read_text(encoding="utf-8", errors="replace")
        return "".join(line for line in text.splitlines(True) if "RTPS_TRANSPORT_SHM" not in line)

    @property
    def exit_code(self) -> int | None:
        return self._process.poll()

    def wait_for_output(self, text: str, timeout_s: float = PATIENCE_S) -> str:
        """Wait until it has printed `text`; returns the line that contains it."""

        def check() -> str | None:
            for line in self.output.splitlines():
                if text in line:
                    return line
            if self.exit_code is not None:
                raise AssertionError(f"ended with {self.exit_code} before {text!r}:\n{self.output}")
            return None

        return str(wait_for(check, f"{text!r} in the output", timeout_s))

    def wait_until_listening(self, port: int) -> None:
        """Wait until it accepts connections at a port of loopback."""

        def listens() -> bool:
            assert self.exit_code is None, self.output
            with socket.socket() as client:
                return client.connect_ex(("127.0.0.1", port)) == 0

        wait_for(listens, f"{self._process.args!r} to listen")

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the process alone."""
        self._process.send_signal(number)

    def stand_still(self) -> None:
        """Stop the process for 1.5 s, as Ctrl-Z does, and let it go on."""
        until = time.monotonic() + 1.5
        self.freeze()
        wait_for(lambda: time.monotonic() > until, "the time to pass")
        self.thaw()

    def freeze(self) -> None:
        """Stop the process; returns when each of its threads stands still."""
        self.send(signal.SIGSTOP)
        wait_for(self._stands_still, "all threads to stand still")

    def thaw(self) -> None:
        self.send(signal.SIGCONT)

    def holds_signals_back(self) -> bool:
        """Whether SIGINT and SIGTERM are blocked, by Linux's account."""
        blocked = int(
            Path(f"/proc/{self.pid}/status").read_text().split("SigBlk:")[1].split()[0], 16
        )
        return all(blocked >> (number - 1) & 1 for number in (signal.SIGINT, signal.SIGTERM))

    def _stands_still(self) -> bool:
        stats = [path.read_text() for path in Path(f"/proc/{self.pid}/task").glob("*/stat")]
        # proc(5): the state comes after the name, which may contain anything.
        return all(stat.rpartition(") ")[2].startswith("T") for stat in stats)

    def wait(self, timeout_s: float = PATIENCE_S) -> int:
        return self._process.wait(timeout_s)

    def stop(self, number: signal.Signals = signal.SIGINT, timeout_s: float = PATIENCE_S) -> int:
        """Signal it and wait for its end; returns the exit code."""
        self.send(number)
        return self.wait(timeout_s)

    def kill(self) -> None:
        """Kill it and all that it started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


def run(command: Sequence[str], env: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    """A command's output and exit code; one of our programs is forked, as a `Process` is."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        if _can_be_forked(command, env):
            code = _template().start(command, env, out, err).wait(PATIENCE_S)
        else:
            code = subprocess.Popen(command, env=env, stdout=out, stderr=err).wait(PATIENCE_S)
        out.seek(0)
        err.seek(0)
        return subprocess.CompletedProcess(command, code, out.read(), err.read())


def run_here(*words: object) -> subprocess.CompletedProcess[str]:
    """Output and exit code of a command that needs no ROS; it runs in this process."""
    from lupin_bridge.cli.command import main

    own = [str(word) for word in words]
    out, err = io.BytesIO(), io.StringIO()
    stdout = io.TextIOWrapper(out, "utf-8", "surrogateescape", write_through=True)
    with contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(err):
        try:
            code = main(own)
        except SystemExit as ended:
            code = int(ended.code or 0)
    printed = out.getvalue().decode(errors="surrogateescape")
    return subprocess.CompletedProcess(own, code, printed, err.getvalue())


def twin_node(domain: int, *ros_args: str, afresh: bool = False, **env: str) -> Process:
    """The twin alone, as the executable `twin_node`."""
    command = [sys.executable, "-m", "lupin_twin.cli", *ros_args]
    return Process(command, ros_env(domain, **env), afresh=afresh)


def lupin_twin(domain: int, role: str, *args: str, afresh: bool = False, **env: str) -> Process:
    """`lupin-twin ROLE` on a free port; `url_of` gives its address."""
    has_faults = bool({"--raise", "--hang"} & {*args})
    is_other = has_faults or {"--limit", "--constant"} & {*args}
    module = "tests.support.limited" if is_other else "lupin_bridge.cli.command"
    command = [sys.executable, "-m", module, role, "--port", "0", *args]
    # A failing function has to be replaced before anything imports it.
    return Process(command, ros_env(domain, **env), afresh=afresh or has_faults)


def limits(**values: float) -> tuple[str, ...]:
    """Arguments of `lupin_twin` for other `Limits` than a bridge has."""
    pairs = [f"{name}={value!r}" for name, value in values.items()]
    return tuple(word for pair in pairs for word in ("--limit", pair))


def constants(**values: float) -> tuple[str, ...]:
    """Arguments of `lupin_twin` for other constants of modules, by `module:NAME`."""
    pairs = [f"{name}={value!r}" for name, value in values.items()]
    return tuple(word for pair in pairs for word in ("--constant", pair))


def faults(kind: Literal["--raise", "--hang"], *places: str) -> tuple[str, ...]:
    """Arguments of `lupin_twin` for functions that fail or hang (`limited`)."""
    return tuple(word for place in places for word in (kind, place))


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def patrols_of(pid: int) -> list[int]:
    """The patrol that a demo has started, without the process for its past (`--fill-past`)."""
    return children_of(pid, b"lupin_patrol\0")


def children_of(pid: int, word: bytes) -> list[int]:
    """The child processes with this word on their command line."""
    tasks = Path(f"/proc/{pid}/task")
    children = [
        int(child)
        for task in tasks.iterdir()
        for child in (task / "children").read_text(encoding="ascii").split()
    ]
    return [child for child in children if word in _command(child)]


def is_running(pid: int | str) -> bool:
    """Whether a process exists and is no zombie (proc_pid_stat(5))."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    except (FileNotFoundError, ProcessLookupError):  # gone before or during the read
        return False
    return stat.rpartition(") ")[2][0] != "Z"


def url_of(process: Process) -> str:
    """The address that a `lupin-twin` process announces once it serves."""
    return process.wait_for_output("lupin-twin: http").partition(": ")[2].strip()


def _can_be_forked(command: Sequence[str], env: Mapping[str, str]) -> bool:
    return "PYTEST_VERSION" in os.environ and _template().can_be(command, env)


@cache
def _template() -> Template:
    return Template()


def _command(pid: int) -> bytes:
    """Its command line (proc_pid_cmdline(5)); empty once it is gone."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return b""


def _state_of_its_own(env: Mapping[str, str]) -> dict[str, str]:
    """A state folder for a process, unless it was given one: it starts without a past."""
    state = os.environ["XDG_STATE_HOME"]
    if env.get("XDG_STATE_HOME", state) != state:
        return {}
    Path(state).mkdir(exist_ok=True)
    return {"XDG_STATE_HOME": tempfile.mkdtemp(dir=state)}
