import pytest

from lupin_bridge.routes.pages import language_of

SPOKEN = ("en", "de", "nl", "es")


@pytest.mark.parametrize(
    ("asked", "accepted", "language"),
    [
        (None, "", "en"),
        (None, "de-AT,de;q=0.9,en;q=0.8", "de"),
        (None, "fr-FR, nl;q=0.7, en;q=0.6", "nl"),
        (None, "en;q=0.5,es;q=0.501", "es"),
        (None, "es , de", "es"),
        (None, "de;q=0", "en"),
        (None, "*", "en"),
        (None, "fr,pl;q=0.9", "en"),
        (None, ";q=1,,de;q=0.1", "de"),
        ("nl", "de", "nl"),
        ("DE-ch", "", "de"),
        # What is not spoken is not the browser's own language either.
        ("xx", "de", "en"),
        ("", "de", "en"),
    ],
)
def test_the_language_of_who_asks(asked: str | None, accepted: str, language: str) -> None:
    assert language_of(asked, accepted, SPOKEN) == language
