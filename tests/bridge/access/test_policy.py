"""Host, Origin and Sec-Fetch: which requests may pass, and how the others are refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.datastructures import Headers

from lupin_bridge.access.policy import AccessPolicy, Decision, exposure, host_of, parse_origin

POLICY = AccessPolicy(
    "greenhouse.lan",
    ["http://panel.example:3000", "https://Robot.Example", "http://[fd00::7]:80"],
    ["TWIN.example."],
)
PASS = Decision()


def judge(
    host: str = "127.0.0.1:8000",
    *origins: str,
    scheme: str = "http",
    wants_page: bool = False,
    **others: str,
) -> Decision:
    given = [("host", host), *(("origin", it) for it in origins)]
    given += [(name.replace("_", "-"), it) for name, it in others.items() if it]
    return POLICY.judge(scheme, headers(*given), wants_page=wants_page)


def headers(*given: tuple[str, str]) -> Headers:
    return Headers(raw=[(name.encode(), value.encode("latin-1")) for name, value in given])


OWN = (
    *("127.0.0.1", "192.168.7.20:8000", "[::1]:8000", "[fd00::7]", "LocalHost:8000"),
    *("twin.localhost:8000", "GREENHOUSE.lan.", "robot.example:8443", "twin.example:8443"),
)
FOREIGN = (
    *("evil.example", "127.0.0.1.evil.example", "evil-localhost", "notgreenhouse.lan"),
    "sub.panel.example",
)
INVALID = (*("", " ", "a b", "evil.example/x", "user@127.0.0.1", "127.0.0.1:x", "[::1", "h\u00e4"),)


def test_the_bridges_own_host_passes_and_another_is_refused_with_how_to_allow_it() -> None:
    for host in OWN:
        assert judge(host) == PASS, host
    for host in FOREIGN:
        for written in (host, f"{host}:8000"):
            refusal = str(judge(written).refusal)
            assert repr(host) in refusal
            assert refusal.endswith(f"--allow-host {host}")
    for host in INVALID:
        assert repr(host) in str(judge(host).refusal)
    for hosts in ((), ("127.0.0.1", "evil.example")):
        refusal = str(POLICY.judge("http", headers(*(("host", it) for it in hosts))).refusal)
        assert refusal == f"the request has {len(hosts)} Host headers, expected one"


def test_a_long_host_is_shortened_in_the_answer() -> None:
    assert len(judge("x" * 60_000).refusal or "") < 500
    assert len(judge("127.0.0.1", "http://" + "x" * 60_000).refusal or "") < 500


@pytest.mark.parametrize("name", ["", "*", "a b", "twin.example:80", "http://twin.example", "a/b"])
def test_an_allowed_host_has_to_be_a_valid_name(name: str) -> None:
    with pytest.raises(ValueError, match="expected it without scheme and port") as refused:
        AccessPolicy("127.0.0.1", allowed_hosts=["twin.example", name])
    assert repr(name) in str(refused.value)


@pytest.mark.parametrize(
    ("host", "origin", "scheme", "foreign"),
    [
        # The bridge's own pages.
        ("127.0.0.1:8000", "http://127.0.0.1:8000", "http", None),
        ("localhost:80", "http://localhost", "http", None),
        ("localhost:443", "https://localhost", "https", None),
        ("[::1]:8000", "http://[::1]:8000", "http", None),
        ("Greenhouse.LAN:8000", "http://greenhouse.lan:8000", "http", None),
        # Those of an allowed origin.
        ("127.0.0.1", "http://panel.example:3000", "http", "http://panel.example:3000"),
        ("127.0.0.1", "https://robot.example:443", "http", "https://robot.example"),
        ("127.0.0.1", "http://[fd00::7]", "http", "http://[fd00::7]"),
    ],
)
def test_the_bridges_own_pages_pass_and_those_of_an_allowed_origin_are_marked(
    host: str, origin: str, scheme: str, foreign: str | None
) -> None:
    assert judge(host, origin, scheme=scheme) == Decision(foreign=foreign)


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://127.0.0.1:3000",  # the same host on another port
        "https://127.0.0.1:8000",  # another scheme
        "http://panel.example:3000.evil.example",
        "http://robot.example",
        "http://twin.example",  # its host is allowed, and not its pages
        "null",
        "",
        "http://panel.example:3000 http://evil.example",
    ],
)
def test_a_foreign_origin_is_refused_with_its_name(origin: str) -> None:
    verdict = judge("127.0.0.1:8000", origin)
    assert (verdict.foreign, origin in str(verdict.refusal)) == (None, True)


@pytest.mark.parametrize(
    "text",
    [
        "null",
        "//panel.example",
        "ftp://panel.example",
        "http://",
        "http://panel.example/path",
        "http://user@panel.example",
        "http://*.example",
        "http://panel.example:port",
        "http://panel example",
        "http://panel.example\n",
    ],
)
def test_an_invalid_origin_is_refused_with_what_was_expected(text: str) -> None:
    with pytest.raises(ValueError, match="expected http:// or https://") as refused:
        parse_origin(text)
    assert repr(text) in str(refused.value)


@given(st.text(max_size=40))
def test_any_text_is_a_valid_origin_or_refused(text: str) -> None:
    try:
        origin = parse_origin(text)
    except ValueError:
        return
    assert parse_origin(origin) == origin
    assert host_of(origin.partition("://")[2]) is not None


@pytest.mark.parametrize(
    ("site", "mode", "dest", "passes"),
    [
        ("none", "navigate", "document", True),  # typed into the address bar
        ("same-origin", "cors", "empty", True),
        ("same-origin", "navigate", "iframe", True),  # a frame in an allowed page
        ("cross-site", "navigate", "document", True),  # a link, through which no page can read
        ("same-site", "navigate", "document", True),
        ("cross-site", "no-cors", "image", False),  # <img>, <script>, <link>
        ("same-site", "no-cors", "image", False),  # the same from another port of this host
        ("cross-site", "navigate", "iframe", False),
        ("cross-site", "navigate", "object", False),
        ("cross-site", "no-cors", "document", False),
    ],
)
def test_a_foreign_page_without_an_origin_header_gets_nothing(
    site: str, mode: str, dest: str, passes: bool
) -> None:
    refusal = judge(sec_fetch_site=site, sec_fetch_mode=mode, sec_fetch_dest=dest).refusal
    assert (refusal is None) == passes
    assert passes or "--allow-origin" in str(refusal)


def test_an_allowed_origin_may_send_cross_site_requests() -> None:
    requested = ("127.0.0.1", "http://panel.example:3000")
    assert judge(*requested, sec_fetch_site="cross-site", sec_fetch_mode="cors").refusal is None


@pytest.mark.parametrize(
    ("referer", "passes"),
    [
        ("", True),  # a program, or a page that sends no referrer
        ("http://127.0.0.1:8000/docs?a=http://evil.example", True),
        ("http://panel.example:3000/board", True),
        ("http://evil.example", False),
        ("http://evil.example/http://127.0.0.1:8000/", False),
        ("http://127.0.0.1:3000/", False),
        ("http://127.0.0.1:8000@evil.example/", False),
        ("https://127.0.0.1:8000/", False),
        ("android-app://com.example/", False),
    ],
)
def test_without_sec_fetch_the_referer_identifies_the_page(referer: str, passes: bool) -> None:
    assert (judge(referer=referer).refusal is None) == passes
    assert judge(referer=referer, wants_page=True).refusal is None, "it may be a link"
    assert judge(referer=referer, sec_fetch_site="same-origin").refusal is None
    hidden = judge(referer=referer, sec_fetch_site="cross-site", wants_page=True)
    assert hidden.refusal is not None, "it tells more than a Referer does"


def test_only_listening_beyond_loopback_warns_about_missing_protection() -> None:
    for address in ("127.0.0.1", "127.8.8.8", "::1"):
        assert exposure(address, has_token=False, has_tls=False) == []
    for address in ("0.0.0.0", "::", "192.168.7.20", "fe80::1%eth0"):
        without_both = exposure(address, has_token=False, has_tls=False)
        assert ["without LUPIN_TOKEN" in it for it in without_both] == [True, False]
        assert ["without --tls-cert" in it for it in without_both] == [False, True]
        assert all(address in warning for warning in without_both)
        assert exposure(address, has_token=True, has_tls=True) == []
        assert exposure(address, has_token=False, has_tls=True) == without_both[:1]
        (in_clear,) = exposure(address, has_token=True, has_tls=False)
        assert "the token too" in in_clear
