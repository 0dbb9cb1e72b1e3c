"""What a WebSocket client may say as JSON, up to the limits and past them."""

import pytest

from lupin_bridge.serving.ws_protocol import MAX_MESSAGE_LENGTH, members_of


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
def test_what_is_nested_deep_ends_in_a_refusal(opening: str, closing: str) -> None:
    # orjson has a limit of its own; without, thousands of levels would end the process.
    levels = (MAX_MESSAGE_LENGTH - 8) // len(opening + closing)
    for end in ("", f"0{closing * levels}}}"):
        text = refusal(f'{{"x":{opening * levels}{end}')
        assert text.startswith("the message is not JSON: ")
