"""The rules of the shared token, and the sessions that it opens."""

import pytest

from lupin_bridge.access import credentials
from lupin_bridge.access.credentials import (
    MAX_COOKIE_BYTES,
    MIN_TOKEN_LENGTH,
    SHARED_SESSION_S,
    CookieTooLong,
    Credentials,
    cookies_of,
)
from lupin_bridge.settings import SettingError

TOKEN = "correct-horse~battery.staple/42+x="
OURS = Credentials(TOKEN)
NOW_S = 1_700_000_000.0


def test_a_token_that_is_short_or_that_no_header_can_carry_is_refused_and_never_shown() -> None:
    for token in ("", "short", "x" * (MIN_TOKEN_LENGTH - 1)):
        length = f"LUPIN_TOKEN has {len(token)} characters, must have at least {MIN_TOKEN_LENGTH}"
        with pytest.raises(SettingError, match=length) as refused:
            Credentials(token)
        assert not token or token not in str(refused.value)
    for odd in (" ", "\n", "ä", '"', ";", ",", "\x00", "=x"):
        with pytest.raises(SettingError, match="RFC 6750") as refused:
            Credentials(f"0123456789abcdef{odd}0123456789")
        assert "0123456789" not in str(refused.value)


def test_a_session_holds_at_every_replica_of_the_token_until_it_ends() -> None:
    cookie, replica = OURS.cookie(NOW_S), Credentials(TOKEN)
    session = replica.session_of(cookie, NOW_S + SHARED_SESSION_S - 1)
    assert session is not None
    assert (session.name, session.role) == ("", "viewer")
    assert session.ends_at_s == NOW_S + SHARED_SESSION_S
    assert replica.cookie_name == OURS.cookie_name
    assert not OURS.session_of(cookie, NOW_S + SHARED_SESSION_S)
    another = Credentials(TOKEN + "=")
    assert not another.session_of(cookie, NOW_S)
    assert another.cookie_name != OURS.cookie_name
    assert TOKEN not in cookie + repr(OURS) + str(vars(OURS))


@pytest.mark.parametrize("made_up", ["", ".", "\u0660", "x" * 8_000])
def test_a_changed_cookie_is_refused(made_up: str) -> None:
    ends, name, mac = OURS.cookie(NOW_S).split(".")
    for cookie in (
        made_up,
        f"{int(ends) + 1}.{name}.{mac}",
        f"{ends}0.{name}.{mac}",
        f"{ends}.{name[::-1]}.{mac}",
        f"{ends}.{name}.{mac[::-1]}",
        f"{ends}.{name}.{made_up}",
        f"{ends}.{mac}",
    ):
        assert not OURS.session_of(cookie, NOW_S)


def test_signed_out_sessions_are_remembered_up_to_a_limit_the_longest_lasting_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(credentials, "MAX_SIGNED_OUT", 2)
    ours = Credentials(TOKEN)
    cookies = [ours.cookie(NOW_S + later_s) for later_s in range(4)]
    for cookie in cookies[:3]:
        session = ours.session_of(cookie, NOW_S)
        assert session is not None
        ours.sign_out(session)
        assert not ours.still(session, NOW_S)
    assert [ours.session_of(cookie, NOW_S) is not None for cookie in cookies] == [
        *(True, False, False, True)
    ]


# --- cookies --------------------------------------------------------------------------------------

NAME = "lupin_session_0011aabb"


@pytest.mark.parametrize(
    ("header", "values"),
    [
        ("", []),
        (f"theme=dark; {NAME}=a.b; other=1", ["a.b"]),
        (f"theme=dark;{NAME}=a.b\t;", ["a.b"]),
        (f"x{NAME}=a", []),
        (f"{NAME}x=a", []),
        (f"{NAME}=a; {NAME}=b", ["a", "b"]),
        (f'{NAME}="a\\"b"', ['"a\\"b"']),
    ],
)
def test_every_value_of_the_name_is_found_and_nothing_else(header: str, values: list[str]) -> None:
    assert cookies_of(NAME, [(b"host", b"x"), (b"cookie", header.encode())]) == values


def test_all_header_lines_count_and_bytes_that_are_no_text_do_no_harm() -> None:
    lines = [(b"cookie", f"{NAME}=a".encode()), (b"cookie", f"{NAME}=\xff".encode("latin-1"))]
    assert cookies_of(NAME, lines) == ["a", "\xff"]
    assert cookies_of(NAME, [(b"set-cookie", f"{NAME}=a".encode())]) == []


@pytest.mark.parametrize("lines", [1, 2])
def test_a_cookie_header_is_read_up_to_its_limit(lines: int) -> None:
    own = f"{NAME}=a".encode()
    fill = (MAX_COOKIE_BYTES - lines * len(own)) // lines
    headers = [(b"cookie", own + b";" * fill) for _ in range(lines)]
    assert sum(len(value) for _, value in headers) == MAX_COOKIE_BYTES
    assert cookies_of(NAME, headers) == ["a"] * lines
    with pytest.raises(CookieTooLong, match=f"Cookie has {MAX_COOKIE_BYTES + 1} bytes, the limit"):
        cookies_of(NAME, [*headers, (b"cookie", b";")])
