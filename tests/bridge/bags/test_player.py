"""`demo --from`: what the page shows of a played recording, with real processes over DDS."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock

from tests.support.messages import occupancy_grid, scan
from tests.support.processes import Process, children_of, is_running, lupin_twin, twin_node, url_of
from tests.support.recordings import OBSERVATIONS, Sent, write_bag
from tests.support.web import Listener, listener, tag_ids

DAY_S = 86_400.0


def seen(tag_id: str, at_s: float, topic: str = OBSERVATIONS) -> Sent:
    return Sent(topic, at_s, scan(tag_id, {"co2": 1.0}, stamp_s=at_s))


def time_of(frame: Any) -> int:
    return int(frame["state"]["header"]["stamp"]["sec"])


@contextmanager
def demo_of(domain: int, *words: object) -> Iterator[tuple[Process, Listener]]:
    """A demo of recordings. It deletes its journal and its player at the end."""
    folder = Path(str(words[0])).parent
    with (
        lupin_twin(domain, "demo", "--from", *map(str, words), TMPDIR=str(folder)) as demo,
        listener(url_of(demo)) as screen,
    ):
        yield demo, screen
        players = children_of(demo.pid, b"bags.player")
        assert demo.stop() == 0
        assert "Traceback" not in demo.output
        assert list(folder.glob("lupin-twin-*")) == []
        assert not any(map(is_running, players))


def test_silences_are_reported_and_skipped_on_request(domain: int, tmp_path: Path) -> None:
    sent = [seen("before", 5_000.0), seen("after", 5_000.0 + DAY_S)]
    path = write_bag(tmp_path / "run.mcap", sent)
    with demo_of(domain, path) as (demo, screen):
        screen.until("state", lambda frame: tag_ids(frame["state"]) == ["before"])
        demo.wait_for_output("the recording is silent for 86,400 s: --skip-gaps SECONDS")
    with demo_of(domain, path, "--skip-gaps", "60") as (_, screen):
        last = screen.until("state", lambda frame: len(tag_ids(frame["state"])) == 2)
        assert time_of(last) >= 5_000 + DAY_S


def test_with_a_start_time_earlier_positions_and_the_last_map_are_known(
    domain: int, tmp_path: Path
) -> None:
    """More observations than the 50 that a publisher stores."""
    names = {f"early {number}" for number in range(70)}
    sent = [seen(name, 5_000.0 + number) for number, name in enumerate(sorted(names))]
    sent += [Sent("/map", 5_000.0 + it, occupancy_grid([[0] * (it + 1)])) for it in range(3)]
    sent.append(seen("still to come", 5_500.0))
    path = write_bag(tmp_path / "run.mcap", sent)
    with demo_of(domain, path, "--start", "100", "--speed", "0.1") as (demo, screen):
        shown = screen.until("state", lambda frame: names <= set(tag_ids(frame["state"])))
        assert "still to come" not in tag_ids(shown["state"])
        assert 5_100 <= time_of(shown) < 5_200
        assert httpx.get(f"{url_of(demo)}/api/map").json()["info"]["width"] == 3


def test_a_recorded_clock_is_the_time(domain: int, tmp_path: Path) -> None:
    """The other stamps are from another clock. At the end of the recording, time stops."""
    sent = [Sent("/clock", 90_000.0 + it, Clock(clock=Time(sec=5_000 + it))) for it in range(20)]
    sent.append(Sent(OBSERVATIONS, 90_010.5, scan("1", {"co2": 1.0}, stamp_s=5_010.0)))
    path = write_bag(tmp_path / "run.mcap", sorted(sent, key=lambda it: it.at_s))
    with demo_of(domain, path, "--speed", "10") as (_, screen):
        status = screen.until(
            "status", lambda frame: bool(frame["journal"]["state"] == "recording")
        )
        assert status["origin"] == "recorded"
        shown = screen.until(
            "state", lambda frame: time_of(frame) == 5_019 and tag_ids(frame["state"]) == ["1"]
        )
        assert shown["state"]["tags"][0]["stale_seconds"] == 9.0
        assert len(list(tmp_path.glob("lupin-twin-*/journal.sqlite"))) == 1


def test_a_loop_starts_again_without_later_data(domain: int, tmp_path: Path) -> None:
    """With files in any order, and a topic that is renamed."""
    later = write_bag(tmp_path / "run_1.mcap", [seen("b", 5_020.0, "/gh1/seen")])
    first = write_bag(tmp_path / "run.mcap", [seen("a", 5_000.0, "/gh1/seen")])
    with demo_of(domain, later, first, "--loop", "--speed", "5") as (_, screen):
        screen.until(
            "state", lambda frame: time_of(frame) == 5_020 and len(tag_ids(frame["state"])) == 2
        )
        assert screen.until("state", lambda frame: time_of(frame) < 5_010)


def test_a_second_twin_stops_the_player_because_its_journal_would_store_the_recording(
    domain: int, tmp_path: Path
) -> None:
    path = write_bag(tmp_path / "run.mcap", [seen("a", 5_000.0)])
    with twin_node(domain), demo_of(domain, path) as (demo, _):
        demo.wait_for_output("several twins run in ROS domain")
        demo.wait_for_output("the player ended with exit code 1")
