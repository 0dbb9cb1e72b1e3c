"""What no server should send: it is dropped, counted and told, and nothing blanks."""

import copy
import json
import re
from collections.abc import Callable
from typing import Any, Final

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from tests.browser.hmi import Hmi, OpenPage
from tests.browser.house import TAGS
from tests.support.web import Bridge

Frame = dict[str, Any]


class Tap:
    """Stands in every state socket of a page: passes on what the server says, and adds to it."""

    def __init__(self, page: Page) -> None:
        self.sockets: list[WebSocketRoute] = []
        self.states: list[Frame] = []
        page.route_web_socket(re.compile("/ws/state"), self._meet)

    def _meet(self, socket: WebSocketRoute) -> None:
        self.sockets.append(socket)
        server = socket.connect_to_server()

        def on_message(message: str | bytes) -> None:
            frame = json.loads(message)
            if frame["type"] == "state":
                self.states.append(frame)
            socket.send(message)

        server.on_message(on_message)

    def say(self, message: str | bytes) -> None:
        """Let the page hear this on its newest socket."""
        self.sockets[-1].send(message)

    def state(self) -> Frame:
        """A copy of the last whole state."""
        return copy.deepcopy(self.states[-1])


def tag_with(**over: Any) -> Callable[[Frame], Any]:
    """The state with its first tag so changed."""

    def change(frame: Frame) -> Any:
        frame["state"]["tags"][0].update(over)
        return frame

    return change


READING: Final = {"name": "temperature", "value": 1.0, "observed_at": None}
DEEP: Final = "[" * 100_000 + "]" * 100_000
# One of each kind; `frames.test.ts` breaks every field of every frame.
HOSTILE: Final[dict[str, Callable[[Frame], Any]]] = {
    "null": lambda _: None,
    "no tags": lambda frame: {**frame, "state": {"header": frame["state"]["header"]}},
    "NaN as text": tag_with(readings=[{**READING, "value": "NaN"}]),
    "blooms without end": tag_with(flowers=[{}] * 20_000),
    "a status of another twin": lambda _: {"type": "status", "twin": {"live": True}},
}


@pytest.fixture
def tapped(house: Bridge, open_page: OpenPage) -> tuple[Hmi, Tap]:
    """A page that shows the whole house, and the tap in its socket."""
    hmi = open_page(house.url, go=False)
    # A busy machine may lose its connection, and the next before it is open.
    hmi.allow_noise("closed before the connection is established")
    tap = Tap(hmi.page)
    hmi.go()
    hmi.expect_rows(*TAGS)
    hmi.expect_samples(3)
    return hmi, tap


UNREAD: Final = re.compile(r"^(A message|\d+ messages) from the server could not be read")


def dropped(hmi: Hmi) -> int:
    """How many messages the page says that it has dropped."""
    told = hmi.page.locator("[data-trouble=unread]").all_inner_texts()
    number = UNREAD.search(told[0]) if told else None
    return 0 if number is None else int(number[1].split()[0].replace("A", "1"))


def say_until_dropped(hmi: Hmi, tap: Tap, message: str | bytes) -> None:
    """Let the page hear what it cannot read; one more is counted.

    What is said on a connection that a busy machine loses meanwhile nobody hears: said again.
    """
    before = dropped(hmi)
    said_on: list[WebSocketRoute] = []

    def is_counted() -> bool:
        if said_on[-1:] != tap.sockets[-1:]:
            hmi.expect_phase("live")
            said_on.append(tap.sockets[-1])
            tap.say(message)
        return dropped(hmi) > before

    hmi.expect(is_counted, "a message more that could not be read")
    assert dropped(hmi) <= before + len(said_on)


def test_a_bad_frame_is_dropped_counted_and_told(tapped: tuple[Hmi, Tap]) -> None:
    hmi, tap = tapped
    expect(hmi.page.locator("[data-trouble]")).to_have_count(0)
    say_until_dropped(hmi, tap, "no json")
    expect(hmi.page.locator("[data-trouble=unread]")).to_contain_text("a message that is no JSON")
    for name, change in HOSTILE.items():
        say_until_dropped(hmi, tap, json.dumps(change(tap.state())))
        assert hmi.rows() == list(TAGS), name
    # What JSON cannot say but a server may send, and what would exhaust a stack.
    for text in (
        json.dumps(tag_with(stale_seconds=float("nan"))(tap.state())),
        json.dumps(tag_with(stale_seconds=0)(tap.state())).replace(
            '"stale_seconds": 0', '"stale_seconds": 1e999'
        ),
        DEEP,
        json.dumps(tap.state())[:-1],
        b"\xa1\x00",
    ):
        say_until_dropped(hmi, tap, text)
    hmi.expect_phase("live")
    hmi.expect_rows(*TAGS)
    expect(hmi.cell("1", "temperature")).to_have_text("20.0")


def test_what_is_deep_beside_the_contract_does_no_harm(tapped: tuple[Hmi, Tap]) -> None:
    hmi, tap = tapped
    frame = tap.state()
    frame["state"]["tags"][0]["more"] = "DEEP"
    frame["seq"] += 1_000
    before = len(tap.sockets)
    for _ in range(2):
        tap.say(json.dumps(frame).replace('"DEEP"', DEEP))
    hmi.expect_rows(*TAGS)
    # Deltas of the server build on another frame now: a new connection puts that right.
    hmi.expect(lambda: len(tap.sockets) > before, "a new connection")
    hmi.expect_phase("live")
    hmi.expect_rows(*TAGS)
    expect(hmi.test_id("failed-page")).to_have_count(0)


BREAK: Final = """() => {
  window.stayed = true;
  CanvasRenderingContext2D.prototype.clearRect = () => { throw new Error('no more canvas'); };
}"""


def test_a_wall_screen_that_fails_comes_back_by_itself(house: Bridge, open_page: OpenPage) -> None:
    wall = open_page(house.url, "sensor=humidity", "?kiosk=1")
    wall.expect_samples(3)
    wall.allow_noise("no more canvas")
    wall.page.evaluate(BREAK)
    wall.page.set_viewport_size({"width": 1000, "height": 700})
    expect(wall.test_id("failed-page")).to_contain_text("reloads automatically")
    wall.expect_samples(3)
    assert wall.page.evaluate("window.stayed") is None
    assert json.loads(wall.page.evaluate("sessionStorage['lupin-twin.reload']"))["failures"] == 1
