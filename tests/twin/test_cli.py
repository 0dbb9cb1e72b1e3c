"""The command `twin_node`: a clean end at every moment, and one line for impossible arguments."""

import signal
import sys
from pathlib import Path

import pytest

from tests.support.domains import ros_env
from tests.support.processes import Process, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for

# A moment of the start, visible from outside by what the process has loaded by then.
MOMENTS = {
    "signals held back": ("python", signal.SIGINT),
    "rclpy is being imported": ("_rclpy_pybind11", signal.SIGTERM),
    "the node is being made": ("/dev/shm/", signal.SIGINT),
}


def output_after_start(process: Process) -> list[str]:
    """The twin's output without the lines of its start, if it got so far."""
    starts = ("lupin_twin in ROS domain", "[lupin_twin]: journal /")
    return [
        line for line in process.output.splitlines() if not any(start in line for start in starts)
    ]


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_signal_during_the_start_ends_it_without_errors(domain: int, moment: str) -> None:
    name, number = MOMENTS[moment]
    with twin_node(domain, afresh=True) as process:
        wait_for(process.holds_signals_back, "signals to be held back")
        maps = Path(f"/proc/{process.pid}/maps")
        wait_for(lambda: name in maps.read_text(), moment)
        assert process.stop(number) == 0
        assert output_after_start(process) == []


def test_a_signal_between_many_callbacks_ends_it_without_errors(domain: int) -> None:
    fast = ("--ros-args", "-p", "state_publish_rate_hz:=100.0")
    with twin_node(domain, *fast) as process, Peer(domain) as peer:
        peer.state(lambda _: True, "a state")
        assert process.stop(signal.SIGTERM) == 0
        assert output_after_start(process) == []


def test_it_goes_on_after_it_was_stopped_for_a_while(domain: int) -> None:
    with twin_node(domain) as process, Peer(domain) as peer:
        peer.state(lambda _: True, "a state")
        process.stand_still()
        # One that ends now may still print a last line.
        for word in ("a first", "a second", "a third"):
            before = peer.states[-1].header.stamp
            peer.state(lambda state: state.header.stamp != before, f"{word} state")  # noqa: B023
        assert process.exit_code is None


def test_it_exits_with_1_when_its_thread_dies(domain: int) -> None:
    program = (
        "import lupin_twin.ros.base_node as spinning, lupin_twin.cli as cli, sys; "
        "spinning.spin_until_shutdown = lambda *_: None; "
        "sys.exit(cli.main())"
    )
    with Process([sys.executable, "-c", program], ros_env(domain)) as process:
        assert process.wait() == 1


def test_an_argument_that_is_not_for_ros_is_refused_and_help_starts_no_twin(domain: int) -> None:
    for word, code, said in (("--help", 0, "after --ros-args"), ("--rate", 2, "ments: --rate")):
        with twin_node(domain, word) as process:
            assert process.wait() == code
            assert said in process.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-p"], "Couldn't parse trailing -p flag"),
        (["-r", "__node:=bad name"], "__node:=bad name"),
        (["-r", "two\nlines"], "-r two lines"),
        (["--params-file", "/nonexistent.yaml"], "/nonexistent.yaml"),
        (["-p", "use_sim_time:=5"], "parameter use_sim_time is not a bool"),
        (["-p", "idw_power:=-1.0"], "parameter idw_power is -1.0"),
        (["-p", "layers:=['soil moisture']"], "parameter layers is 'soil moisture'"),
    ],
)
def test_impossible_arguments_are_refused_in_one_line(
    domain: int, arguments: list[str], message: str
) -> None:
    with twin_node(domain, "--ros-args", *arguments) as process:
        assert process.wait() == 2
        [line] = [line for line in process.output.splitlines() if line.startswith("lupin_twin: ")]
        assert message in line
        # Beside it only what ROS itself may log.
        others = [text for text in process.output.splitlines() if text != line]
        assert all(text.startswith("[") for text in others), others
