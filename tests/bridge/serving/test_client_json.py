"""JSON messages of a WebSocket client, at the limits and past them."""

import pytest

from lupin_bridge.serving.ws_protocol import MAX_MESSAGE_LENGTH, members_of


def refusal(message: str | bytes) -> str:
    with pytest.raises(ValueError, match=r".") as caught:
        members_of(message)
    return str(caught.value)


def test_only_an_object_is_accepted() -> None:
    assert members_of('{"a": [1]}') == {"a": [1]}
    assert refusal(b"{}") == "a binary frame is refused, expected JSON text"
    assert refusal("[]") == "the message is an array, expected an object"
    assert refusal("3") == "the message is 3, expected an object"
    assert refusal("{").startswith("the message is not JSON: ")
    assert refusal('{"a": NaN}').startswith("the message is not JSON: ")


def test_a_too_long_message_is_not_parsed() -> None:
    longest = '{"x":"' + "x" * (MAX_MESSAGE_LENGTH - 8) + '"}'
    assert len(members_of(longest)["x"]) == MAX_MESSAGE_LENGTH - 8
    assert refusal(longest + " ") == "the message has 16385 characters, the limit is 16384"


@pytest.mark.parametrize(("opening", "closing"), [("[", "]"), ('{"a":', "}")])
def test_deep_nesting_is_refused(opening: str, closing: str) -> None:
    # orjson has its own limit; without it, thousands of levels would crash the process.
    levels = (MAX_MESSAGE_LENGTH - 8) // len(opening + closing)
    for end in ("", f"0{closing * levels}}}"):
        text = refusal(f'{{"x":{opening * levels}{end}')
        assert text.startswith("the message is not JSON: ")
