"""The token's rules, who is let in by it, and the cookie that stands for it."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.access.credentials import (
    MIN_TOKEN_LENGTH,
    SESSION_S,
    BrowserSession,
    Credentials,
    TokenError,
)

TOKEN = "correct-horse~battery.staple/42+x="
OURS = Credentials(TOKEN)
NOW_S = 1_700_000_000.0
NAME = "0123456789abcdef" * 2


@pytest.mark.parametrize("token", ["", "short", "x" * (MIN_TOKEN_LENGTH - 1)])
def test_a_short_token_is_refused_by_its_length_and_never_shown(token: str) -> None:
    with pytest.raises(TokenError) as refused:
        Credentials(token)
    message = str(refused.value)
    assert f"LUPIN_TOKEN has {len(token)} characters" in message
    assert f"at least {MIN_TOKEN_LENGTH}" in message
    assert not token or token not in message


@pytest.mark.parametrize("odd", [" ", "\n", "ä", '"', ";", ",", "\x00", "=x"])
def test_a_token_that_no_header_can_carry_is_refused_and_never_shown(odd: str) -> None:
    token = f"0123456789abcdef{odd}0123456789"
    with pytest.raises(TokenError, match="RFC 6750") as refused:
        Credentials(token)
    assert "0123456789" not in str(refused.value)


def test_the_shortest_token_does() -> None:
    token = "x" * MIN_TOKEN_LENGTH
    assert Credentials(token).accepts_header(f"Bearer {token}")


@pytest.mark.parametrize("scheme", ["Bearer", "bearer", "BEARER"])
def test_the_token_is_accepted_behind_its_scheme(scheme: str) -> None:
    assert OURS.accepts_header(f"{scheme} {TOKEN}")
    assert OURS.accepts_header(f"{scheme}  {TOKEN} ")


@pytest.mark.parametrize(
    "header",
    [
        "",
        "Bearer",
        "Bearer ",
        TOKEN,
        f"Basic {TOKEN}",
        f"Bearer {TOKEN}x",
        f"Bearer {TOKEN[:-1]}",
        f"Bearer {TOKEN.upper()}",
        f"Bearer x{TOKEN}",
        f"Bearer {TOKEN} {TOKEN}",
        f"Bearer{TOKEN}",
        "Bearer \xff\xfe",
    ],
)
def test_anything_else_is_not(header: str) -> None:
    assert not OURS.accepts_header(header)


def test_a_session_lasts_until_it_ends() -> None:
    cookie = OURS.cookie(NAME, NOW_S)
    session = BrowserSession(NAME, int(NOW_S) + SESSION_S)
    assert OURS.session_of(cookie, NOW_S) == session
    assert OURS.session_of(cookie, NOW_S + SESSION_S - 1)
    assert not OURS.session_of(cookie, NOW_S + SESSION_S)


def test_a_session_holds_at_every_replica_and_after_a_restart() -> None:
    other = Credentials(TOKEN)
    assert other.session_of(OURS.cookie(NAME, NOW_S), NOW_S)
    assert other.cookie_name == OURS.cookie_name


def test_a_new_token_ends_every_session() -> None:
    other = Credentials(TOKEN + "=")
    assert not other.session_of(OURS.cookie(NAME, NOW_S), NOW_S)
    assert other.cookie_name != OURS.cookie_name


def test_a_cookie_cannot_be_made_to_last_longer() -> None:
    ends, _, rest = OURS.cookie(NAME, NOW_S).partition(".")
    for later in (f"{int(ends) + 1}", f"{ends}0", f"0{ends}"):
        assert not OURS.session_of(f"{later}.{rest}", NOW_S)


def test_nor_to_be_another_session() -> None:
    ends, name, mac = OURS.cookie(NAME, NOW_S).split(".")
    for other in (name[::-1], name.upper(), name[:-1], f"{name}0", ""):
        assert not OURS.session_of(f"{ends}.{other}.{mac}", NOW_S)
    assert not OURS.session_of(f"{ends}.{mac}", NOW_S)


def test_a_cookie_is_neither_the_token_nor_a_plain_hash_of_it() -> None:
    cookie = OURS.cookie(NAME, NOW_S)
    assert re.fullmatch(rf"[0-9]+\.{NAME}\.[0-9a-f]{{64}}", cookie)
    assert TOKEN not in cookie


@given(st.text(max_size=100))
def test_no_other_text_is_a_cookie(text: str) -> None:
    assert not OURS.session_of(text, NOW_S)


@pytest.mark.parametrize("mac", ["0" * 64, "", "f" * 63, "F" * 64, "\u0660" * 64])
def test_a_made_up_mac_is_refused(mac: str) -> None:
    assert not OURS.session_of(f"{int(NOW_S) + 60}.{NAME}.{mac}", NOW_S)


def test_credentials_do_not_show_the_token() -> None:
    assert TOKEN not in repr(OURS) + str(vars(OURS))
