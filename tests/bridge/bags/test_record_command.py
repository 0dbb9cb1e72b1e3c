from __future__ import annotations

import contextlib
import random
import signal
import sys
import time
from pathlib import Path

import pytest
from lupin_msgs.msg import Observation
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.highlevel import AnyReader

from lupin_bridge import cli
from lupin_bridge.bags import record_command
from lupin_bridge.bags.recover import recover
from lupin_bridge.bags.rotation import Limits
from lupin_bridge.message_schemas import schema_text
from tests.support.bags import by_rosbags, plain, read, read_unfinished
from tests.support.domains import ros_env
from tests.support.messages import discovered, look, occupancy_grid, pose, scan
from tests.support.processes import Process
from tests.support.ros import Peer, clock_at
from tests.support.waiting import wait_for


def recorder(domain: int, *args: str | Path, shell: str = "exec", streams: str = "") -> Process:
    """`lupin-twin record`; a shell may lead its `streams` elsewhere, and do more before."""
    command = [sys.executable, "-m", "lupin_bridge.cli", "record", *map(str, args)]
    if streams or shell != "exec":
        command = ["bash", "-c", f'{shell} "$@" {streams}', "bash", *command]
    return Process(command, ros_env(domain))


def test_what_is_recorded_is_what_was_sent(domain: int, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    sent = [
        ("/house/floranova/observations", scan("a", {"temperature": 21.5}, (1, 2), stamp_s=3.25)),
        ("/house/floranova/observations", look("a", "lupin", blooms=[(1, 2)], stamp_s=4.0)),
        ("/house/perception/discovered_tags", discovered({"b": pose(3, 4)})),
        ("/house/map", occupancy_grid([[0, 100], [-1, 50]])),
    ]
    with Peer(domain) as peer, recorder(domain, path, "--namespace", "house") as process:
        for topic, message in sent:  # latched, and nobody listens yet
            peer.publish(topic, message)
        clock = peer.node.create_publisher(type(clock_at(0)), "/clock", 10)

        def tick() -> bool:
            clock.publish(clock_at(12.5))
            topics = [topic for topic, *_ in read_unfinished(path)] if path.exists() else []
            clocks = topics.count("/clock")
            return clocks > 0 and len(topics) - clocks == len(sent)

        peer.until(tick, "all of it in the file")
        assert process.stop() == 0
        assert "recorded " in process.output
        assert f" in {path}\n" in process.output

    kinds = {topic: type(message) for topic, message in [*sent, ("/clock", clock_at(0))]}
    recorded = read(path)

    def heard(topic: str) -> list[object]:
        of_topic = [data for name, _, _, data in recorded if name == topic]
        return [plain(deserialize_message(data, kinds[topic])) for data in of_topic]

    for topic in kinds.keys() - {"/clock"}:
        messages = [serialize_message(message) for name, message in sent if name == topic]
        as_sent = [plain(deserialize_message(data, kinds[topic])) for data in messages]
        assert heard(topic) == as_sent
    assert heard("/clock")[0] == plain(clock_at(12.5))
    assert all(publish_ns <= log_ns for _, log_ns, publish_ns, _ in recorded)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            assert schema is not None
            by_ros = plain(deserialize_message(message.data, kinds[channel.topic]))
            text = schema.data.decode()
            assert text == schema_text(schema.name)
            assert plain(decoded) == by_ros
            assert plain(by_rosbags(schema.name, text, message.data)) == by_ros
    with AnyReader([path]) as bag:
        durabilities = {
            connection.topic: connection.ext.offered_qos_profiles[0].durability.name  # type: ignore[union-attr]
            for connection in bag.connections
        }
    assert durabilities.pop("/clock") == "VOLATILE"
    assert set(durabilities.values()) == {"TRANSIENT_LOCAL"}


def test_a_terminal_that_is_closed_ends_it_as_ctrl_c_does(domain: int, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    # Whoever runs the tests may ignore it, and what they start would inherit that.
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    process = recorder(domain, path, streams="2>&1")  # started by us, not by our template
    signal.signal(signal.SIGHUP, before)
    with Peer(domain) as peer, process:
        peer.observe(scan("a", {"temperature": 21.5}))
        peer.until(lambda: path.exists() and read_unfinished(path), "it in the file")
        assert process.stop(signal.SIGHUP) == 0
    assert len(read(path)) == 1


def test_under_nohup_it_goes_on_when_the_terminal_is_closed(domain: int, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    ignoring = "trap '' HUP; exec"
    with Peer(domain) as peer, recorder(domain, path, shell=ignoring) as process:
        peer.observe(scan("a", {"temperature": 21.5}))
        peer.until(lambda: path.exists() and read_unfinished(path), "it in the file")
        process.send(signal.SIGHUP)
        for count in (2, 3):
            peer.observe(scan(f"{count}", {"temperature": 21.5}))
            peer.until(lambda: len(read_unfinished(path)) == count, "what comes behind it")  # noqa: B023
        assert process.stop() == 0
    assert len(read(path)) == 3


@pytest.mark.parametrize("streams", ["2>/dev/full", ">/dev/full", "<&- >&- 2>&-", "> >(:) 2>&1"])
def test_whoever_can_be_told_nothing_is_recorded_for(
    domain: int, tmp_path: Path, streams: str
) -> None:
    path = tmp_path / "a.mcap"
    with Peer(domain) as peer, recorder(domain, path, streams=streams) as process:
        peer.observe(scan("a", {"temperature": 21.5}))
        peer.until(lambda: path.exists() and read_unfinished(path), "it in the file")
        assert process.stop() == 0
        assert "Traceback" not in process.output
        assert "Error" not in process.output
    assert len(read(path)) == 1


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["a.db3"], "a.db3 does not end in .mcap"),
        (["nowhere/a.mcap"], "cannot make nowhere/a.mcap: there is no folder nowhere"),
        (["there.mcap"], "there.mcap is there already, and nothing is overwritten"),
        (["there.mcap/a.mcap"], "there.mcap/a.mcap: there is no folder there.mcap"),
        (["link.mcap"], "link.mcap is a link that leads nowhere, and nothing is overwritten"),
        (["loop.mcap/a.mcap"], "loop.mcap/a.mcap: Too many levels of symbolic links"),
        ([f"{'a' * 300}.mcap"], "a.mcap: File name too long"),
    ],
)
def test_what_cannot_be_a_recording_is_refused(
    args: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.mcap").write_bytes(b"mine")
    (tmp_path / "link.mcap").symlink_to("nowhere")
    (tmp_path / "loop.mcap").symlink_to("loop.mcap")
    assert cli.main(["record", *args]) == 2
    assert said in capsys.readouterr().err
    assert (tmp_path / "there.mcap").read_bytes() == b"mine"


@pytest.mark.parametrize(
    ("option", "at_least", "below"), [("--max-size", "0.1", "0.09"), ("--max-seconds", "1", "0.9")]
)
@pytest.mark.parametrize("value", ["0", "below", "-1", "nan", "much", "1e10"])
def test_a_limit_that_is_none_is_refused(
    option: str, at_least: str, below: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    value = below if value == "below" else value
    with pytest.raises(SystemExit) as refused:
        cli.main(["record", "a.mcap", option, value])
    assert refused.value.code == 2
    assert f"must be a number from {at_least} to 1e9" in capsys.readouterr().err


def test_a_size_is_given_in_megabytes_and_an_age_in_seconds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits: list[Limits] = []

    def record(_: Path, its_limits: Limits) -> int:
        limits.append(its_limits)
        return 0

    monkeypatch.setattr(record_command, "_record", record)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    try:
        for options in (
            ["--max-size", "1.5", "--max-seconds", "60"],
            ["--max-size", "0.1", "--max-seconds", "1"],
            [],
        ):
            assert cli.main(["record", str(tmp_path / "a.mcap"), *options]) == 0
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    assert limits == [Limits(1_500_000, 60.0), Limits(100_000, 1.0), Limits(0, 86_400.0)]


def test_a_kill_at_any_moment_costs_a_second_at_most(domain: int, tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.mcap" for name in "ab"]
    chance = random.Random()
    sent = 0
    with contextlib.ExitStack() as stack:
        peer = stack.enter_context(Peer(domain))
        processes = [stack.enter_context(recorder(domain, path)) for path in paths]

        def publish() -> None:
            nonlocal sent
            for _ in range(2):
                peer.observe(scan(f"tag-{sent}", {"temperature": 20.0, "humidity": 60.0}))
                sent += 1
            peer.spin_briefly()

        def heard(path: Path) -> list[int]:
            data = [data for _, _, _, data in read_unfinished(path)] if path.exists() else []
            return [
                int(deserialize_message(one, Observation).tag_reading.tag_id[4:]) for one in data
            ]

        def grown(path: Path) -> list[int]:
            """What is in the file once it has grown again within a second."""
            sizes: list[tuple[float, int]] = []

            def has_grown() -> bool:
                size = path.stat().st_size
                if not sizes or size > sizes[-1][1]:
                    sizes.append((time.monotonic(), size))
                return len(sizes) > 2 and sizes[-1][0] - sizes[-2][0] < 1.0

            wait_for(has_grown, f"{path} to grow each second", meanwhile=publish)
            return heard(path)

        wait_for(lambda: all(map(heard, paths)), "all of them to record", meanwhile=publish)
        for path, process in zip(paths, processes, strict=True):
            # Not how old the last message is: on a busy machine that is the machine's affair.
            before = grown(path)
            go_on_until = time.monotonic() + chance.uniform(0.0, 0.5)
            wait_for(lambda: time.monotonic() > go_on_until, "a moment", meanwhile=publish)  # noqa: B023
            process.send(signal.SIGKILL)
            process.wait()
            target = path.with_stem(f"{path.stem}_recovered")
            saved = recover(path, target)
            assert not saved.is_finished
            numbers = heard(path)
            assert saved.messages == len(read(target)) == len(numbers) > 0
            assert numbers[: len(before)] == before
