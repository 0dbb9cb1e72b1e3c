"""The access checks of a live bridge, what holds for every answer, and no secret in the log."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from lupin_bridge.access.middleware import GUESS_BURST, MAX_TARGET_BYTES, OPEN_PATHS, Access
from lupin_bridge.serving.http_protocol import MAX_HEAD_BYTES
from lupin_bridge.settings import Settings
from lupin_bridge.stream import schema
from tests.support.access import BEARER, TOKEN, Served, refused_start, served
from tests.support.messages import occupancy_grid, scan
from tests.support.people import OWN
from tests.support.proc_stat import cpu_s
from tests.support.waiting import wait_for
from tests.support.web import ROUTES, Bridge, bridge

PANEL = "http://panel.example:3000"
UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Version": "13",
}
PAGE = {"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"}
WRONG = {"Authorization": f"Bearer {TOKEN[::-1]}"}
PATHS = [path.replace("{tag_id}", "7") for path in ROUTES]


@pytest.fixture(scope="module")
def open_bridge() -> Iterator[Served]:
    """Without a token. Pages of one foreign origin may read, under an allowed host name."""
    with served("--allow-origin", PANEL, "--allow-host", "twin.example") as running:
        assert "LUPIN_TOKEN" not in running.process.output, "nobody else reaches it"
        yield running
        assert "ERROR" not in running.process.output


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """With a token. At the end, neither the right nor the wrong one may be in the logs."""
    folder = tmp_path_factory.mktemp("log")
    with served(LUPIN_TOKEN=TOKEN, ROS_LOG_DIR=str(folder)) as running:
        yield running
        assert "ERROR" not in running.process.output
        logs = [running.process.output, *(f.read_text() for f in folder.rglob("*") if f.is_file())]
        assert not [log for log in logs if TOKEN in log or TOKEN[::-1] in log]


def refusal_of(answer: httpx.Response) -> str:
    """The detail of a refusal, whose headers are checked."""
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert answer.headers["cache-control"] == "no-store"
    return schema.ErrorMessage.model_validate_json(answer.content).detail


def test_a_rebound_name_gets_nothing(open_bridge: Served) -> None:
    rebound = {"Host": "evil.example:8000", "Origin": "http://evil.example:8000"}
    requested = [(path, rebound) for path in ("/api/state", "/healthz", "/", "/signin", "/nowhere")]
    for path, headers in [*requested, ("/ws/state", UPGRADE | rebound)]:
        answer = open_bridge.get(path, headers)
        assert answer.status_code == 403, path
        detail = refusal_of(answer)
        assert "'evil.example'" in detail
        assert detail.endswith("--allow-host evil.example")


def test_a_foreign_page_gets_no_answer_and_no_permission_to_read_one(open_bridge: Served) -> None:
    evil = {"Origin": "http://evil.example"}
    answer = open_bridge.get("/api/state", evil)
    assert answer.status_code == 403
    assert "'http://evil.example'" in refusal_of(answer)
    assert not [name for name in answer.headers if name.startswith("access-control-")]
    for path in ("/ws/state", "/rosbridge", "/foxglove", "/ws/nowhere"):
        assert open_bridge.handshake(path, evil) == 403, path


def test_an_allowed_page_may_read_and_cannot_write_and_a_cache_keeps_the_origins_apart(
    open_bridge: Served,
) -> None:
    answer = open_bridge.get("/api/field?sensor_type=co2", {"Origin": PANEL})
    assert answer.status_code == 200
    assert answer.headers["access-control-allow-origin"] == PANEL
    assert answer.headers["access-control-allow-credentials"] == "true"
    exposed = answer.headers["access-control-expose-headers"].lower().split(", ")
    assert {"etag", "retry-after", "x-field-sample-count"} <= set(exposed)
    assert open_bridge.handshake(headers={"Origin": PANEL}) == 101
    for headers in ({}, {"Origin": PANEL}, {"Origin": "http://evil.example"}):
        assert "Origin" in open_bridge.get("/api/state", headers).headers["vary"]
    both = open_bridge.get("/api/field?sensor_type=co2", {"Origin": PANEL}).headers["vary"]
    assert {part.strip() for part in both.split(",")} == {"Accept", "Origin"}
    for path in ("/api/state", "/api/notes", "/api/signin"):
        answer = open_bridge.post(path, {"Origin": PANEL})
        assert answer.status_code == 403
        assert "may only read here" in refusal_of(answer)


def test_an_allowed_page_may_send_a_preflight_with_a_token(open_bridge: Served) -> None:
    requests = {"Access-Control-Request-Method": "GET"}
    answer = open_bridge.get("/api/state", {"Origin": PANEL, **requests}, method="OPTIONS")
    assert (answer.status_code, answer.content) == (204, b"")
    assert answer.headers["access-control-allow-origin"] == PANEL
    assert answer.headers["access-control-allow-methods"] == "GET, HEAD"
    assert "Authorization" in answer.headers["access-control-allow-headers"]
    assert "X-Lupin-Twin" not in answer.headers["access-control-allow-headers"]
    for origin, status in (("http://evil.example", 403), (open_bridge.url, 405)):
        other = open_bridge.get("/api/state", {"Origin": origin, **requests}, method="OPTIONS")
        assert other.status_code == status
        assert "access-control-allow-origin" not in other.headers


@pytest.mark.parametrize("path", ["/", "/docs", "/signin", "/api/report.html"])
def test_any_page_may_link_to_the_bridge(open_bridge: Served, path: str) -> None:
    linked = {**PAGE, "Referer": "http://wiki.example/greenhouse"}
    assert open_bridge.get(path, linked).status_code in (200, 303, 307)
    assert open_bridge.get("/api/state", linked).status_code == 403, "a frame gets the same"


def test_a_request_target_has_a_length_limit(open_bridge: Served) -> None:
    for path in ("/" + "a/" * 63 + "b", "/api/field?" + "a&" * 2_042 + "b"):
        room = MAX_TARGET_BYTES - len(path.replace("?", ""))
        longest = path + "b" * room
        assert open_bridge.get(longest).status_code in (400, 404)
        refused = open_bridge.get(longest + "b")
        assert refused.status_code == 414
        assert refusal_of(refused) == (
            f"the address has {MAX_TARGET_BYTES + 1} bytes, the limit is {MAX_TARGET_BYTES}"
        )


# Without a token, existing and missing paths look the same.
NOWHERE = ["/nowhere", "/assets/app.js", "/manifest.webmanifest", "/healthz/", "/SIGNIN"]


@pytest.mark.parametrize("path", [*(path for path in PATHS if path not in OPEN_PATHS), *NOWHERE])
def test_every_route_needs_the_token(closed: Served, path: str) -> None:
    answer = closed.get(path)
    assert answer.status_code == 401
    assert answer.headers["www-authenticate"].startswith("Bearer")
    assert refusal_of(answer) == (
        "a token is needed: send it as Authorization: Bearer, or sign in at /signin"
    )
    assert closed.get(path, BEARER).status_code not in (401, 403, 429)


@pytest.mark.parametrize("path", sorted(OPEN_PATHS))
def test_liveness_and_the_sign_in_page_need_no_token(closed: Served, path: str) -> None:
    assert closed.get(path).status_code == 200


@pytest.mark.parametrize(
    ("path", "location"),
    [
        ("/", "signin"),
        ("/docs", "signin"),
        ("/api/report.html?hours=12", "../signin"),
        ("/?lang=de-AT&x=1", "signin?lang=de-AT"),
        ("/?lang=%0d%0aX:1", "signin"),
        ("/some/where/", "../../signin"),
        ("//evil", "../signin"),
    ],
)
def test_a_browser_is_sent_to_the_sign_in_page(closed: Served, path: str, location: str) -> None:
    answer = closed.get(closed.url + path, PAGE)
    assert (answer.status_code, answer.headers["location"]) == (303, location)
    assert answer.headers["cache-control"] == "no-store"


@pytest.mark.parametrize("path", ["/ws/state", "/rosbridge", "/foxglove"])
def test_a_websocket_needs_the_token(closed: Served, path: str) -> None:
    assert closed.handshake(path) == 401
    answer = closed.get(path, UPGRADE)
    assert answer.headers["www-authenticate"].startswith("Bearer")
    assert "a token is needed" in refusal_of(answer)


def session_of(closed: Served) -> str:
    return closed.post("/api/signin", BEARER).headers["set-cookie"].partition(";")[0]


def test_a_session_is_found_among_other_cookies(closed: Served) -> None:
    session = session_of(closed)
    cookie = f'a="\\"; {session.partition("=")[0]}=0.0; {session}; ' + "x" * 7_000
    assert closed.get("/api/state", {"Cookie": cookie}).status_code == 200
    assert closed.handshake(headers={"Cookie": cookie}) == 101
    assert session.partition("=")[2] not in closed.process.output


@pytest.mark.parametrize("inside", ['\\"', "\\012", ";"])
def test_a_hostile_cookie_delays_no_other_client(closed: Served, inside: str) -> None:
    name = session_of(closed).partition("=")[0]
    # A longer request head is refused before its cookies are read.
    hostile = f'{name}="{inside * ((MAX_HEAD_BYTES - 2_000) // len(inside))}"'
    with closed.client() as client:
        before_s = cpu_s(closed.process.pid)
        for _ in range(10):
            assert client.get("/api/state", headers={"Cookie": hostile}).status_code == 401
        # Alone, one takes the standard library's parser a second; all of these take a tenth.
        assert cpu_s(closed.process.pid) - before_s < 5.0


def test_a_token_elsewhere_opens_nothing_and_a_writing_method_is_refused_before_its_path(
    closed: Served,
) -> None:
    assert closed.get("/api/state", {"Authorization": f"Basic {TOKEN}"}).status_code == 401
    for query in (f"?token={TOKEN}", f"?access_token={TOKEN}", f"?LUPIN_TOKEN={TOKEN}"):
        assert closed.get("/api/state" + query).status_code == 401
        assert closed.handshake("/ws/state" + query) == 401
    assert closed.get("/api/state", method="POST").status_code == 401
    assert closed.get("/api/state", BEARER, method="POST").status_code == 405


def test_guessing_slows_down_only_the_guesser(closed: Served) -> None:
    session, taken = session_of(closed), 0
    with closed.client("127.0.5.1") as guesser, closed.client("127.0.5.2") as other:

        def is_right_one_refused() -> bool:
            nonlocal taken
            while (answer := guesser.get("/api/state", headers=WRONG)).status_code == 401:
                assert "not the bridge's token" in refusal_of(answer)
                taken += 1
                assert taken < 20 * GUESS_BURST, "there is no end to guessing"
            assert answer.status_code == 429
            assert 1 <= int(answer.headers["retry-after"]) <= 6
            assert "127.0.5.1 has sent" in refusal_of(answer)
            return guesser.post("/api/signin", headers={**BEARER, **OWN}).status_code == 429

        wait_for(is_right_one_refused, "no oracle: the right token is not looked at either")
        assert taken >= GUESS_BURST
        # A session cannot be guessed, so it goes on. Other addresses notice nothing.
        assert guesser.get("/api/state", headers={"Cookie": session}).status_code == 200
        assert other.get("/api/state", headers=BEARER).status_code == 200
    assert closed.process.output.count("wrong token from 127.0.5.1") == taken


def test_valid_tokens_and_expired_cookies_do_not_count_as_guesses(closed: Served) -> None:
    with closed.client("127.0.6.1") as client:
        for _ in range(GUESS_BURST + 5):
            assert client.get("/api/state", headers=BEARER).status_code == 200
            old = {"Cookie": "lupin_session_00000000=1.0"}
            assert client.get("/api/state", headers=old).status_code == 401
        assert client.get("/api/state", headers=BEARER).status_code == 200


@pytest.mark.parametrize(
    ("option", "wrong", "is_no"),
    [
        ("--allow-origin", "panel.example", "an origin"),
        ("--allow-host", "https://twin.example", "a host's name"),
    ],
)
def test_an_impossible_host_or_origin_is_refused_at_the_start(
    option: str, wrong: str, is_no: str
) -> None:
    assert f"lupin-twin: {option}: '{wrong}' is not {is_no}" in refused_start(option, wrong)


def test_accounts_that_are_missing_and_listening_beyond_loopback_are_warnings(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    missing = tmp_path / "acounts.sqlite"
    with served("--host", "0.0.0.0", "--accounts", str(missing)) as live:
        warnings = [line for line in live.process.output.splitlines() if "WARNING" in line]
        assert (
            f"--accounts: {missing} does not exist; until it does, nobody is asked" in warnings[0]
        )
        assert "without LUPIN_TOKEN" in warnings[1]
        assert "without --tls-cert" in warnings[2]
        assert live.get("/api/state").status_code == 200, "it goes by its addresses"
    # As in a folder of somebody else: whether there is a file cannot be seen.
    unseen = Settings(accounts=str(tmp_path / ("x" * 300)))
    assert Access.of(unseen, None).is_closed
    assert "does not exist" not in caplog.text


ELSEWHERE = ["/", "/nowhere", "/ws/state"]
QUERY = {"sensor_type": "co2", "resolution": "0.5"}
IN_CELLS = {path for path in PATHS if "field" in path or "estimate" in path}
SENSOR = {"sensor_type": "co2"}
OF_SENSOR = {f"/api/estimate/{name}" for name in ("advice", "quality", "tags")}
POSTED = ("/api/signin", "/api/signout")
SERIES = {"tag_id": "7", "sensor_type": "co2"}
# Without an end, a period ends now, and its file name contains that second.
PERIOD = {"from": "1", "to": "5"}
PAST = {"/api/history": SERIES, "/api/timeline": {}, "/api/export.csv": {}}


@pytest.fixture(scope="module")
def twin() -> Iterator[Bridge]:
    with bridge() as running:
        running.peer.observe(scan("7", {"co2": 400.0}, at=(1, 1)))
        running.peer.publish_map(occupancy_grid([[0]]))
        running.tag("7")
        running.peer.until(lambda: running.get("/api/map").status_code == 200, "the map")
        yield running


def send(twin: Bridge, method: str, path: str) -> httpx.Response:
    query = PAST[path] | PERIOD if path in PAST else QUERY if path in IN_CELLS else None
    return twin.http.request(method, path, params=query if path not in OF_SENSOR else SENSOR)


@pytest.mark.parametrize("path", PATHS)
def test_head_is_get_without_the_body(twin: Bridge, path: str) -> None:
    got, head = (send(twin, method, path) for method in ("GET", "HEAD"))
    assert (got.status_code, head.status_code, head.content) == (200, 200, b"")
    assert got.content
    # The other headers depend on the time: lengths, ETags, file names.
    for name in ("content-type", "cache-control", "vary"):
        assert head.headers.get(name) == got.headers.get(name), name


@pytest.mark.parametrize("path", [*(path for path in PATHS if path != "/api/notes"), *ELSEWHERE])
@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE", "BREW"])
def test_any_method_but_a_read_is_refused(twin: Bridge, path: str, method: str) -> None:
    answer = send(twin, method, path)
    assert answer.status_code == 405
    assert answer.headers["allow"] == "GET, HEAD"
    message = schema.ErrorMessage.model_validate_json(answer.content)
    assert message.detail == f"method {method} is not allowed here, use GET or HEAD"


@pytest.mark.parametrize("path", POSTED)
def test_signing_in_and_out_needs_post_with_a_header_that_no_form_can_send(
    twin: Bridge, path: str
) -> None:
    for method in ("GET", "HEAD", "PUT", "DELETE", "OPTIONS"):
        answer = twin.http.request(method, path, headers=OWN)
        assert (answer.status_code, answer.headers["allow"]) == (405, "POST"), method
    answer = twin.http.post(path)
    assert answer.status_code == 403
    assert answer.json() == {"detail": "POST without the header X-Lupin-Twin, expected any value"}
    assert twin.http.post(path, headers=OWN).status_code == 404, "this bridge needs no token"


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/api/state", 200),
        ("GET", "/docs", 307),
        ("GET", "/api/field.png?sensor_type=co2", 200),
        ("GET", "/api/field", 400),
        ("GET", "/nowhere", 404),
        ("POST", "/api/state", 405),
    ],
)
def test_every_answer_has_the_security_headers(
    twin: Bridge, method: str, path: str, status: int
) -> None:
    answer = twin.http.request(method, path)
    assert answer.status_code == status
    policy = dict(
        part.strip().split(" ", 1) for part in answer.headers["content-security-policy"].split(";")
    )
    assert policy["default-src"] == policy["connect-src"] == "'self'"
    assert policy["img-src"] == "'self' blob: data:"
    assert policy["object-src"] == policy["base-uri"] == policy["frame-ancestors"] == "'none'"
    assert "script-src" not in policy, "the default allows no inline script"
    assert "unsafe" not in answer.headers["content-security-policy"]
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["x-frame-options"] == "DENY"
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert answer.headers["cross-origin-opener-policy"] == "same-origin"
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert "server" not in answer.headers
