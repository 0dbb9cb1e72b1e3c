"""What the protocols answer by themselves."""

from __future__ import annotations

import h11
import pytest

from lupin_bridge.serving.connections import refusal
from lupin_bridge.stream import schema


@pytest.mark.parametrize("status", [400, 414, 431])
def test_it_is_a_whole_answer_and_the_last(status: int) -> None:
    client = h11.Connection(h11.CLIENT)
    client.send(h11.Request(method="GET", target="/", headers=[("Host", "x")]))
    client.send(h11.EndOfMessage())
    client.receive_data(refusal(status, "no: „this“"))
    head, body, end = (client.next_event() for _ in range(3))
    assert isinstance(head, h11.Response)
    assert head.status_code == status
    assert isinstance(body, h11.Data)
    assert schema.ErrorMessage.model_validate_json(bytes(body.data)).detail == "no: „this“"
    assert isinstance(end, h11.EndOfMessage)
    assert client.their_state is h11.MUST_CLOSE
