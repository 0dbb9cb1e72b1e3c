import pytest
from fastapi import Request

from lupin_bridge.routes.pages import language_of

SPOKEN = ("en", "de", "nl", "es")


@pytest.mark.parametrize(
    ("requested", "accepted", "language"),
    [
        ("", "", "en"),
        ("", "de-AT,de;q=0.9,en;q=0.8", "de"),
        ("", "fr-FR, nl;q=0.7, en;q=0.6", "nl"),
        ("", "en;q=0.5,es;q=0.501", "es"),
        ("", "es , de", "es"),
        ("", "de;q=0", "en"),
        ("", "*", "en"),
        ("", "fr,pl;q=0.9", "en"),
        ("", ";q=1,,de;q=0.1", "de"),
        ("lang=nl", "de", "nl"),
        ("lang=DE-ch", "", "de"),
        # No variant of the browser's language either.
        ("lang=xx", "de", "en"),
        ("lang=", "de", "en"),
    ],
)
def test_the_language_is_chosen_from_accept_language(
    requested: str, accepted: str, language: str
) -> None:
    headers = [(b"accept-language", accepted.encode())]
    request = Request({"type": "http", "query_string": requested.encode(), "headers": headers})
    assert language_of(request, SPOKEN) == language
