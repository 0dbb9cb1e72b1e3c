"""When what is published, and what time it is by the recording."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.bags import player
from lupin_bridge.bags.gaps import Gap
from lupin_bridge.bags.player import BEAT_HZ, LAG_S, MAX_A_BEAT, Player, Playing, due_in_s
from lupin_bridge.bags.recordings import Recordings
from tests.support.messages import discovered, occupancy_grid, pose, scan
from tests.support.recordings import OBSERVATIONS, TAGS, Sent, write_bag
from tests.support.ros import clock_at

KEPT = {OBSERVATIONS: 50, TAGS: 50, "/map": 1}
BEAT_S = 1.0 / BEAT_HZ
START_S = 100.0


class Heard:
    """An outlet that takes down what it is told: (topic, moment of the steady clock).

    `known` is what time it was by the recording as each message came.
    """

    def __init__(self) -> None:
        self.times: list[float] = []
        self.messages: list[tuple[str, float]] = []
        self.known: list[float] = []
        self.begun_again = 0
        self.now_s = 0.0

    def tell_time(self, now_ns: int) -> None:
        self.times.append(now_ns / 1e9)

    def publish(self, topic: str, data: bytes) -> None:
        assert data
        self.messages.append((topic, self.now_s))
        self.known.append(self.times[-1])

    def begin_again(self) -> None:
        self.begun_again += 1


class Stage:
    """A player, and a steady clock of the test's own."""

    def __init__(self, recording: Recordings, playing: Playing) -> None:
        self.heard = Heard()
        self.player = Player(recording, self.heard, playing)

    def go_on(self, for_s: float) -> list[tuple[str, float]]:
        """Beat for so long; returns what was published meanwhile."""
        before = len(self.heard.messages)
        for _ in range(round(for_s / BEAT_S)):
            self.player.beat(self.heard.now_s)
            self.heard.now_s += BEAT_S
        return self.heard.messages[before:]


@contextmanager
def stage(
    folder: Path, sent: Sequence[Sent], playing: Playing | None = None, *, is_chunked: bool = True
) -> Iterator[Stage]:
    with Recordings([write_bag(folder / "a.mcap", sent, is_chunked=is_chunked)]) as recording:
        yield Stage(recording, playing or Playing(KEPT))


def scans(*at_s: float) -> list[Sent]:
    return [Sent(OBSERVATIONS, START_S + it, scan("1", {"co2": 1.0})) for it in at_s]


def test_messages_go_out_at_their_moments_behind_the_clock(tmp_path: Path) -> None:
    with stage(tmp_path, scans(0.0, 1.0, 2.0)) as it:
        sent = it.go_on(3.0)
        assert it.player.is_over
    for (_, at_s), moment_s in zip(sent, (0.0, 1.0, 2.0), strict=True):
        # The clock had come to its moment so long before.
        known_s = it.heard.times[round((at_s - LAG_S) / BEAT_S)] - START_S
        assert moment_s <= known_s <= moment_s + 2 * BEAT_S
    assert it.heard.times[0] == START_S
    assert it.heard.times[-1] == START_S + 2.0, "the time stands at the end"
    assert it.heard.times == sorted(it.heard.times)


def test_speed_is_that_of_the_clock(tmp_path: Path) -> None:
    for speed in (0.1, 1.0, 100.0):
        with stage(tmp_path, scans(0.0, 1_000.0), Playing(KEPT, speed=speed)) as it:
            it.go_on(5.0)
            assert abs(it.player.position_s - 5.0 * speed) <= 2 * BEAT_S * speed


def test_it_lasts_as_long_as_what_is_not_played_of_it(tmp_path: Path) -> None:
    sent = [*scans(0.0), Sent("/map", START_S + 2.0, occupancy_grid([[0]]))]
    with stage(tmp_path, sent, Playing({OBSERVATIONS: 50})) as it:
        assert len(it.go_on(1.9)) == 1
        assert not it.player.is_over
        assert it.go_on(0.3) == []
        assert it.player.is_over


def test_a_process_that_stood_still_goes_on_from_where_it_stood(tmp_path: Path) -> None:
    with stage(tmp_path, scans(0.0, 600.0)) as it:
        it.go_on(1.0)
        it.heard.now_s += 500.0
        it.go_on(1.0)
        assert it.player.position_s < 2.5


def test_a_pause_stops_the_time_and_says_so_on(tmp_path: Path) -> None:
    with stage(tmp_path, scans(0.0, 1.0), Playing(KEPT, is_paused=True)) as it:
        assert it.go_on(5.0) == []
        assert set(it.heard.times) == {START_S}
        assert len(it.heard.times) == round(5.0 / BEAT_S)
        it.player.toggle()
        assert len(it.go_on(0.5)) == 1
        it.player.toggle()
        standing_s = it.player.position_s
        assert it.go_on(5.0) == []
        assert it.player.position_s == standing_s
        it.player.toggle()
        assert len(it.go_on(2.0)) == 1
        assert it.player.is_over


def test_from_a_start_on_all_before_it_comes_first_and_of_a_map_the_last(tmp_path: Path) -> None:
    maps = [Sent("/map", START_S + it, occupancy_grid([[0]])) for it in (0.5, 1.5, 2.5, 61.0)]
    sent = [*scans(*range(60)), *scans(60.0, 62.0), *maps]
    sent.sort(key=lambda it: it.at_s)
    for is_chunked in (True, False):
        with stage(tmp_path, sent, Playing(KEPT, start_s=59.5), is_chunked=is_chunked) as it:
            before = it.go_on(LAG_S + math.ceil(61 / MAX_A_BEAT) * BEAT_S)
            assert set(it.heard.times) == {START_S + 59.5}, "the time waits for it"
            assert [topic for topic, _ in before].count("/map") == 1
            assert [topic for topic, _ in before].count(OBSERVATIONS) == 60
            assert [topic for topic, _ in it.go_on(3.5)] == [OBSERVATIONS, "/map", OBSERVATIONS]


def test_paused_at_a_start_what_lay_before_is_there(tmp_path: Path) -> None:
    with stage(tmp_path, scans(0.0, 1.0, 2.0), Playing(KEPT, start_s=1.5, is_paused=True)) as it:
        assert len(it.go_on(2.0)) == 2


def test_a_loop_begins_again_as_it_began(tmp_path: Path) -> None:
    with stage(tmp_path, scans(0.0, 1.0), Playing(KEPT, loops=True)) as it:
        sent = it.go_on(3.5)
        assert len(sent) in (6, 7)
        assert it.heard.begun_again == 3
        assert it.heard.times.count(START_S) == 4


def test_recorded_time_is_the_time(tmp_path: Path) -> None:
    """Of a simulation: when it was recorded is another clock's."""
    ticks = [Sent("/clock", START_S + it, clock_at(7.0 + it)) for it in (0.0, 1.0, 2.0)]
    with stage(tmp_path, [*ticks, *scans(2.5)], Playing(KEPT, start_s=1.5)) as it:
        it.go_on(0.2)
        assert set(it.heard.times) == {8.0}
        assert it.go_on(2.0) == [(OBSERVATIONS, it.heard.messages[0][1])]
        assert set(it.heard.times) == {8.0, 9.0}


def test_a_burst_is_spread_and_no_time_passes_that_nobody_could_follow(tmp_path: Path) -> None:
    count = 3_000
    with stage(tmp_path, [*scans(*[0.0] * count), *scans(30.0)]) as it:
        per_beat = [len(it.go_on(BEAT_S)) for _ in range(count // MAX_A_BEAT + 10)]
        assert max(per_beat) == MAX_A_BEAT
        assert sum(per_beat) == count
        assert it.player.position_s < 1.5


def test_no_more_is_read_ahead_than_may_wait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(player, "MAX_AHEAD", 10)
    sent = scans(*[0.0] * 30, 60.0)
    for start_s in (0.0, 30.0):
        with stage(tmp_path, sent, Playing(KEPT, start_s=start_s)) as it:
            it.go_on(2 * BEAT_S)
            assert len(it.player._waiting) == 10
            assert len(it.go_on(1.0)) == 30


@pytest.mark.parametrize(("most_bytes", "ahead"), [(3_000, 3), (100, 1)])
def test_large_ones_are_not_all_read_ahead_and_one_that_is_larger_than_all_goes_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most_bytes: int, ahead: int
) -> None:
    monkeypatch.setattr(player, "MAX_AHEAD_BYTES", most_bytes)
    maps = [Sent("/map", START_S, occupancy_grid([[0] * 1_000])) for _ in range(200)]
    taken = 0
    with stage(tmp_path, [*maps, *scans(1.0)]) as it:
        read = it.player._recording.messages

        def counting(*args: Any, **query: Any) -> Iterator[Any]:
            nonlocal taken
            for message in read(*args, **query):
                taken += 1
                yield message

        monkeypatch.setattr(it.player._recording, "messages", counting)
        it.player._begin()
        it.go_on(2 * BEAT_S)
        assert taken == ahead
        assert len(it.go_on(60.0)) == 201


def test_a_gap_is_told_at_once_and_waited_for(tmp_path: Path) -> None:
    for speed, at_s, told in (
        (1.0, 60.0, []),
        (1.0, 60.1, [Gap(100 * 10**9, 160_100_000_000)]),
        (2.0, 120.0, []),
        (2.0, 120.2, [Gap(100 * 10**9, 220_200_000_000)]),
    ):
        with stage(tmp_path, scans(0.0, at_s), Playing(KEPT, speed=speed)) as it:
            it.go_on(2 * BEAT_S)
            assert it.player.take_gaps() == told
            assert len(it.go_on(59.0)) == 1
            assert it.player.take_gaps() == []
            assert len(it.go_on(2.0)) == 1


@pytest.mark.parametrize("has_clock", [True, False])
def test_a_gap_that_is_too_long_is_jumped_over_once_all_before_it_is_out(
    tmp_path: Path, has_clock: bool
) -> None:
    """Also that before the first message of a twin's, and that behind its last one."""
    sent = [Sent("/a", START_S, scan("0")), *scans(1e6, 1e6 + 10.0, 2e6)]
    sent.append(Sent("/a", START_S + 3e6, scan("0")))
    if has_clock:
        sent = [Sent("/clock", it.at_s, clock_at(it.at_s - START_S)) for it in sent[1:-1]] + sent
        sent.sort(key=lambda it: it.at_s)
    zero_s = 0.0 if has_clock else START_S
    with stage(tmp_path, sent, Playing({OBSERVATIONS: 50}, skip_s=10.0)) as it:
        times = it.heard.times
        assert [topic for topic, _ in it.go_on(1.0)] == [OBSERVATIONS]
        assert abs(times[-1] - (zero_s + 1e6)) <= 1.0
        assert len(it.go_on(9.0)) == 0
        assert len(it.go_on(1.0)) == 2, "10 s are waited for; then the one behind the next gap"
        assert times[-1] == zero_s + (2e6 if has_clock else 3e6)
        assert it.player.is_over
        for known_s, sent_s in zip(it.heard.known, (1e6, 1e6 + 10.0, 2e6), strict=True):
            assert abs(known_s - (zero_s + sent_s)) <= 1.0, "what is not out is not left behind"
        between = {time for time in times if zero_s + 1e6 + 10.5 < time < zero_s + 2e6}
        assert not between
        gaps = it.player.take_gaps()
        assert [(gap.seconds, gap.is_skipped) for gap in gaps] == [
            (1e6, True),
            (2e6 - 1e6 - 10.0, True),
            (1e6, True),
        ]


def test_what_an_index_does_not_know_of_comes_at_the_end(tmp_path: Path) -> None:
    with Recordings([write_bag(tmp_path / "a.mcap", scans(0.0, 1.0, 5.0))]) as recording:
        recording.end_ns -= 4 * 10**9
        it = Stage(recording, Playing(KEPT))
        assert len(it.go_on(2.0)) == 3
        assert it.player.is_over


def test_what_a_twin_could_take_in_another_order_goes_out_in_another_beat(tmp_path: Path) -> None:
    found = Sent(TAGS, START_S, discovered({"1": pose()}))
    with stage(tmp_path, [found, *scans(0.0), found, *scans(0.0)]) as it:
        sent = it.go_on(1.0)
    assert [topic for topic, _ in sent] == [TAGS, OBSERVATIONS, TAGS, OBSERVATIONS]
    moments = [at_s for _, at_s in sent]
    assert moments[0] < moments[1] == moments[2] < moments[3]


def test_beats_are_steady() -> None:
    assert abs(due_in_s(10.0, 10.0) - BEAT_S) < 1e-9
    assert abs(due_in_s(10.0, 10.0 + 1.25 * BEAT_S) - 0.75 * BEAT_S) < 1e-9
