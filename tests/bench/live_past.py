"""Whether questions about the past delay what is live: the same clients without them and with them.

Twenty WebSocket clients follow a robot at 10 Hz, over a journal of a year of 30 tags, while others
ask, each one after the other, what is dearest to answer: states and fields of a million cells of
random moments, histories and timelines of the whole year, and exports of all of it.
"""

from __future__ import annotations

import http.client
import random
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from tests.bench.journal_double import QUICK_YEAR, SECOND, YEAR, House, filled
from tests.bench.live_parts import Clients, Server, serving

LIVE = 20
RATE_HZ = 10.0
# Each from an address of its own, so that it is the limits of all together that hold.
QUESTIONS = {
    "state": "/api/state?at={at}",
    "field 1000 x 1000": "/api/field.npy?sensor_type=co2&at={at}&resolution=0.01"
    "&bbox_min_x=0&bbox_min_y=0&bbox_max_x=10&bbox_max_y=10",
    "quality": "/api/field/quality?sensor_type=co2&at={at}&resolution=0.02",
    "history": "/api/history?tag_id=7&sensor_type=co2&points=5000&to={at}",
    "timeline": "/api/timeline?points=5000&to={at}",
    "export": "/api/export.csv?to={at}",
}


class Askers:
    """Threads that ask until they are told to end, a question each, and what they got.

    `fill` makes a path of what a question has in braces, by chance.
    """

    def __init__(
        self, port: int, questions: Mapping[str, str], fill: Callable[[str, random.Random], str]
    ) -> None:
        self.answers: Counter[tuple[str, int]] = Counter()
        self._port, self._queries, self._fill = port, questions, fill
        self._is_over = threading.Event()
        self._threads = [
            threading.Thread(target=self._ask, args=(number, what), daemon=True)
            for number, what in enumerate(questions)
        ]

    def start(self) -> None:
        """Begin."""
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """End, each with its answer."""
        self._is_over.set()
        for thread in self._threads:
            thread.join()

    def _ask(self, number: int, what: str) -> None:
        chance = random.Random(number)
        while not self._is_over.is_set():
            # Not out of one's own connection: an export that is given up ends with it.
            client = http.client.HTTPConnection(
                "127.0.0.1", self._port, 60.0, source_address=(f"127.0.9.{number + 1}", 0)
            )
            try:
                client.request("GET", self._fill(self._queries[what], chance))
                answer = client.getresponse()
                while not self._is_over.is_set() and answer.read(65_536):
                    pass
                self.answers[what, answer.status] += 1
            finally:
                client.close()


def _some_moment(house: House, question: str, chance: random.Random) -> str:
    length_s = house.days * 86_400.0
    at_s = house.end_ns / SECOND - chance.uniform(0.0, 0.9) * length_s
    return question.format(at=round(at_s, 3))


@contextmanager
def live_over(journal: Path) -> Iterator[tuple[Server, Clients]]:
    """A server with this journal, its robot, and the clients that follow."""
    options = ("--ros-args", "-p", "journal_days:=36500.0", "-p", f"journal:={journal}")
    with serving(30, RATE_HZ, *options) as server, Clients(server.port, LIVE) as clients:
        clients.joined_s()
        yield server, clients


def measure_past(seconds: float, *, is_quick: bool = False) -> str:
    """The delays of frames, without questions and with them; returns lines of text."""
    house = QUICK_YEAR if is_quick else YEAR
    with live_over(filled(house).path) as (server, clients):
        now_s = time.monotonic()
        without = clients.measure(now_s, now_s + seconds)
        askers = Askers(server.port, QUESTIONS, partial(_some_moment, house))
        askers.start()
        now_s = time.monotonic()
        beside = clients.measure(now_s, now_s + seconds)
        askers.stop()
        after = time.monotonic()
        again = clients.measure(after, after + seconds / 2)
    told = [f"{what} {n} x {status}" for (what, status), n in sorted(askers.answers.items())]
    share = 100 * beside.delivered(LIVE)
    lines = (
        f"{LIVE} clients at {RATE_HZ:g} Hz, {seconds:g} s each, a journal of {house.days:g} days:",
        f"- nothing asked: {without.delays()}, {100 * without.delivered(LIVE):.2f} % delivered",
        f"- beside the dearest questions of the past: {beside.delays()}, {share:.2f} % delivered",
        f"- nothing asked any more: {again.delays()}",
        f"- what was asked all the time, and got: {'; '.join(told)}",
    )
    return "\n".join(lines)
