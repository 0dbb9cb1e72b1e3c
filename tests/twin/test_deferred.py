from __future__ import annotations

from typing import Any

from lupin_twin.responses import Later, allow_later


class Service:
    """What rclpy's executor does with one: it sends what the callback gave."""

    def __init__(self) -> None:
        self.sent: list[tuple[Any, Any]] = []

    def send_response(self, response: Any, header: Any) -> None:
        self.sent.append((response, header))


def test_a_response_that_is_there_is_sent_at_once() -> None:
    service = Service()
    allow_later(service)
    service.send_response("response", "header")
    assert service.sent == [("response", "header")]


def test_a_response_that_comes_later_goes_to_who_asked() -> None:
    service = Service()
    allow_later(service)
    first, second = Later(), Later()
    service.send_response(first, "first")
    service.send_response(second, "second")
    assert service.sent == []
    second.answer(2)
    first.answer(1)
    assert service.sent == [(2, "second"), (1, "first")]


def test_a_response_may_be_there_before_rclpy_tells_whom_to() -> None:
    service = Service()
    allow_later(service)
    later = Later()
    later.answer(1)
    service.send_response(later, "header")
    assert service.sent == [(1, "header")]
