"""What a WebSocket client may say as JSON, up to the limits and past them."""

import pytest

from lupin_bridge.serving.ws_protocol import MAX_BRACKETS, MAX_MESSAGE_LENGTH, members_of


def refusal(message: str | bytes) -> str:
    with pytest.raises(ValueError, match=r".") as caught:
        members_of(message)
    return str(caught.value)


def test_an_object_is_read_and_nothing_else() -> None:
    assert members_of('{"a": [1]}') == {"a": [1]}
    assert refusal(b"{}") == "a binary frame is refused, expected JSON text"
    assert refusal("[]") == "the message is an array, expected an object"
    assert refusal("3") == "the message is 3, expected an object"
    assert refusal("{").startswith("the message is not JSON: ")
    assert refusal('{"a": NaN}').startswith("the message is not JSON: ")


def test_a_long_message_is_not_even_read() -> None:
    longest = '{"x":"' + "x" * (MAX_MESSAGE_LENGTH - 8) + '"}'
    assert len(members_of(longest)["x"]) == MAX_MESSAGE_LENGTH - 8
    assert refusal(longest + " ") == "the message has 16385 characters, the limit is 16384"


@pytest.mark.parametrize(("opening", "closing"), [("[", "]"), ('{"a":', "}")])
def test_deep_nesting_is_not_even_read(opening: str, closing: str) -> None:
    def nested(levels: int) -> str:
        return f'{{"x":{opening * levels}0{closing * levels}}}'

    assert "x" in members_of(nested(MAX_BRACKETS - 1))
    text = refusal(nested(MAX_BRACKETS))
    assert text == "the message opens 1001 brackets, the limit is 1000"
    assert "brackets" in refusal("[" * MAX_MESSAGE_LENGTH)
