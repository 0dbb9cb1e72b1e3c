"""Large messages in pieces, parsed by another library."""

import pytest
from websockets.frames import Frame, Opcode
from websockets.protocol import CLIENT, State
from websockets.protocol import Protocol as Reader

from lupin_bridge.serving.ws_protocol import BINARY, PIECE_BYTES, frame_head, pieces
from lupin_bridge.stream.frames import text_frame


def read(wire: bytes) -> list[Frame]:
    """The frames, parsed by a client that rejects protocol errors."""
    reader = Reader(CLIENT, state=State.OPEN, max_size=None)
    reader.receive_data(wire)
    assert reader.parser_exc is None
    return [event for event in reader.events_received() if isinstance(event, Frame)]


def wire(frame: bytes, rest: bytes = b"") -> bytes:
    return b"".join(bytes(block) for piece in pieces(frame, rest) for block in piece)


# RFC 6455, section 5.2: the length encoding changes at 126 and 65,536.
@pytest.mark.parametrize(
    "length",
    [
        0,
        125,
        126,
        65_535,
        65_536,
        PIECE_BYTES,
        PIECE_BYTES + 1,
        3 * PIECE_BYTES,
        3 * PIECE_BYTES + 1,
    ],
)
def test_a_message_stays_the_same_and_no_piece_exceeds_the_limit(length: int) -> None:
    message = bytes(n % 251 for n in range(length))
    for given, rest, opcode in (
        (text_frame(message), b"", Opcode.TEXT),
        (frame_head(BINARY, len(message)) + message[:13], message[13:], Opcode.BINARY),
    ):
        frames = read(wire(given, rest))
        assert b"".join(frame.data for frame in frames) == message
        assert max(len(frame.data) for frame in frames) <= PIECE_BYTES
        assert [frame.opcode for frame in frames] == [opcode, *[Opcode.CONT] * (len(frames) - 1)]
        assert [frame.fin for frame in frames] == [*[False] * (len(frames) - 1), True]


def test_a_ping_fits_between_two_pieces() -> None:
    row = pieces(frame_head(BINARY, 200_000) + bytes(200_000))
    first, *others = (head + bytes(payload) for head, payload in row)
    ping = Frame(Opcode.PING, b"?").serialize(mask=False)
    assert [frame.opcode for frame in read(first + ping + b"".join(others))] == [
        Opcode.BINARY,
        Opcode.PING,
        Opcode.CONT,
    ]


def test_nothing_is_copied() -> None:
    message = bytes(300_000)
    views = [payload for _, payload in pieces(frame_head(BINARY, len(message)), message)]
    assert all(it.obj is message for it in views if isinstance(it, memoryview))
