"""The cookie that is ours, among whatever else a browser or an attacker sends along."""

from collections.abc import Iterator

import pytest

from lupin_bridge.access.credentials import MAX_COOKIE_BYTES, CookieTooLong, cookies_of
from lupin_bridge.serving.http_protocol import MAX_HEAD_BYTES
from tests.support.access import BEARER, TOKEN, Served, served
from tests.support.proc_stat import cpu_s

NAME = "lupin_session_0011aabb"


@pytest.mark.parametrize(
    ("header", "values"),
    [
        ("", []),
        (";;; = ;", []),
        (NAME, []),
        (f"{NAME}=a.b", ["a.b"]),
        (f"theme=dark; {NAME}=a.b; other=1", ["a.b"]),
        (f"theme=dark;{NAME}=a.b\t;", ["a.b"]),
        (f"x{NAME}=a", []),
        (f"{NAME}x=a", []),
        (f"{NAME.upper()}=a", []),
        (f"{NAME}=a; {NAME}=b", ["a", "b"]),
        (f'{NAME}="a\\"b"', ['"a\\"b"']),
        (f"{NAME}=a=b", ["a=b"]),
    ],
)
def test_every_value_of_the_name_and_nothing_else(header: str, values: list[str]) -> None:
    assert cookies_of(NAME, [(b"host", b"x"), (b"cookie", header.encode())]) == values


def test_all_lines_count_and_what_is_no_text_does_no_harm() -> None:
    lines = [(b"cookie", f"{NAME}=a".encode()), (b"cookie", f"{NAME}=\xff".encode("latin-1"))]
    assert cookies_of(NAME, lines) == ["a", "\xff"]
    assert cookies_of(NAME, [(b"set-cookie", f"{NAME}=a".encode())]) == []


@pytest.mark.parametrize("lines", [1, 2])
def test_as_long_as_the_limit_and_no_longer(lines: int) -> None:
    own = f"{NAME}=a".encode()
    fill = (MAX_COOKIE_BYTES - lines * len(own)) // lines
    headers = [(b"cookie", own + b";" * fill) for _ in range(lines)]
    assert sum(len(value) for _, value in headers) == MAX_COOKIE_BYTES
    assert cookies_of(NAME, headers) == ["a"] * lines
    with pytest.raises(CookieTooLong, match=f"Cookie has {MAX_COOKIE_BYTES + 1} bytes, the limit"):
        cookies_of(NAME, [*headers, (b"cookie", b";")])


# --- served -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def closed() -> Iterator[Served]:
    with served(LUPIN_TOKEN=TOKEN) as running:
        yield running
        assert "ERROR" not in running.process.output


def session_of(closed: Served) -> tuple[str, str]:
    """The name and the value of a session's cookie."""
    pair = closed.post("/api/signin", BEARER).headers["set-cookie"].partition(";")[0]
    name, _, value = pair.partition("=")
    return name, value


@pytest.mark.parametrize("path", ["/api/state", "/signin", "/ws/state"])
@pytest.mark.parametrize("inside", ['\\"', "\\012", ";"])
def test_a_hostile_cookie_keeps_nobody_waiting(closed: Served, path: str, inside: str) -> None:
    name, _ = session_of(closed)
    # A longer head does not come as far as to be looked at.
    hostile = f'{name}="{inside * ((MAX_HEAD_BYTES - 2_000) // len(inside))}"'
    with closed.client() as client:
        before_s = cpu_s(closed.process.pid)
        for _ in range(10):
            answer = client.get(path, headers={"Cookie": hostile})
            assert answer.status_code in (200, 401, 431)
        # One alone takes a second in the standard library's parser; these all, a tenth.
        assert cpu_s(closed.process.pid) - before_s < 5.0


def test_a_session_is_found_among_other_cookies_up_to_the_limit(closed: Served) -> None:
    name, value = session_of(closed)
    cookie = f'a="\\"; {name}=0.0; {name}={value}; '
    longest = cookie + "x" * (MAX_COOKIE_BYTES - len(cookie))
    assert closed.get("/api/state", {"Cookie": longest}).status_code == 200
    assert closed.handshake(headers={"Cookie": longest}) == 101
    refused = closed.get("/api/state", {"Cookie": longest + "x"})
    assert refused.status_code == 431
    assert refused.json() == {
        "detail": f"Cookie has {MAX_COOKIE_BYTES + 1} bytes, the limit is {MAX_COOKIE_BYTES}: "
        "delete the cookies of this host"
    }
    assert closed.handshake(headers={"Cookie": longest + "x"}) == 431
    assert closed.get("/api/state", {"Cookie": longest + "x", **BEARER}).status_code == 200
