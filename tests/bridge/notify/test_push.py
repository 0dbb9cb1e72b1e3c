"""Web Push: a browser's subscription, and our own push service, which decrypts each message."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import ssl
import stat
from collections.abc import AsyncIterator, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from types import SimpleNamespace
from typing import Any

import http_ece
import httpx
import pytest
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from py_vapid import Vapid02
from py_vapid.utils import b64urlencode

from lupin_bridge.access.accounts import MAX_DEVICES, Device
from lupin_bridge.access.people import People
from lupin_bridge.alarms.board import NOTE_BURST, AlarmBoard, Change
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.notify import push as push_module
from lupin_bridge.notify.destinations import Endpoint, PushTarget
from lupin_bridge.notify.push import Push, push_text
from lupin_bridge.notify.webhook import post
from lupin_bridge.past.report_page import PageText
from lupin_bridge.settings import Settings
from tests.support.access import refused_start
from tests.support.messages import inspection
from tests.support.people import (
    OWN,
    TOKEN,
    add,
    changing,
    remove,
    signed_in,
    signed_in_once,
)
from tests.support.processes import constants
from tests.support.receiver import Answer, Posted, Receiver, receiver, status
from tests.support.seen import NOW_NS, Alarms, S, alarm, damp_air
from tests.support.tls import Certificate, certificate
from tests.support.waiting import PATIENCE_S, until, wait_for
from tests.support.web import Bridge, bridge

CONTACT = "mailto:grower@example.org"
_PUSH = "lupin_bridge.notify.push"
SOON = constants(**{f"{_PUSH}:TOGETHER_S": 0.3, f"{_PUSH}:FIRST_WAIT_S": 0.3})


@dataclass
class Phone:
    """A browser, and its keys."""

    endpoint: str
    private: ec.EllipticCurvePrivateKey = field(
        default_factory=lambda: ec.generate_private_key(ec.SECP256R1())
    )
    auth: bytes = b"0123456789abcdef"

    @property
    def subscription(self) -> dict[str, Any]:
        """As a browser sends it."""
        public = self.private.public_key()
        raw = public.public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)
        keys = {"p256dh": b64urlencode(raw), "auth": b64urlencode(self.auth)}
        return {"endpoint": self.endpoint, "expirationTime": None, "keys": keys}

    def read(self, posted: Posted) -> dict[str, str]:
        """The message, which only this browser can decrypt."""
        plain = http_ece.decrypt(
            posted.body, private_key=self.private, auth_secret=self.auth, version="aes128gcm"
        )
        found: dict[str, str] = json.loads(plain)
        return found


@dataclass
class Stage:
    """A push service, and the accounts whose browsers it notifies."""

    service: Receiver
    accounts: Path

    def phone(self, name: str) -> Phone:
        return Phone(f"https://localhost:{self.service.port}/push/{name}")

    def posted_to(self, phone: Phone) -> list[Posted]:
        path = phone.endpoint.partition(str(self.service.port))[2]
        return [it for it in self.service.posted if it.path == path]

    def devices(self) -> list[Device]:
        with changing(self.accounts) as accounts:
            return accounts.devices("")


@contextmanager
def push_service(folder: Path, *answers: Answer) -> Iterator[tuple[Stage, Certificate]]:
    ours, accounts = certificate(folder), folder / "accounts.sqlite"
    add(accounts, anna="operator", bert="viewer")
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(ours.cert, ours.key)
    with receiver(*(answers or (status(201),)), tls=context) as service:
        yield Stage(service, accounts), ours


@dataclass
class Pushing(Stage):
    """Push without a bridge: how it reacts to each answer, with short waits."""

    push: Push
    board: Alarms

    def subscribe(self, phone: Phone) -> None:
        keys = phone.subscription["keys"]
        device = Device(phone.endpoint, keys["p256dh"], keys["auth"], "en")
        with changing(self.accounts) as accounts:
            accounts.add_device("anna", device, "", 0)


@asynccontextmanager
async def pushing(folder: Path, *answers: Answer) -> AsyncIterator[Pushing]:
    with push_service(folder, *answers) as (on, ours), pytest.MonkeyPatch.context() as patch:
        patch.setattr(push_module, "TOGETHER_S", 0.0)
        patch.setattr(push_module, "FIRST_WAIT_S", 0.05)
        target = PushTarget(CONTACT, frozenset({"localhost"}), ours.trust)
        push, board = Push(target, People(on.accounts), ""), Alarms()
        push.start(source_of(board))
        board.on_change = push.on_alarms
        try:
            yield Pushing(on.service, on.accounts, push, board)
        finally:
            await push.stop()


def source_of(board: AlarmBoard) -> Any:
    return SimpleNamespace(
        alarms=board,
        notes=SimpleNamespace(notes=()),
        origin="robot",
        ros_time_ns=NOW_NS,
        criteria=Criteria.of(Settings()),
    )


async def test_an_expired_subscription_is_removed_and_a_busy_service_is_tried_again(
    tmp_path: Path,
) -> None:
    elsewhere = "Location: https://localhost/"
    answers = (status(503), status(410), status(302, elsewhere), status(201))
    async with pushing(tmp_path, *answers) as on:
        phone = on.phone("one")
        on.subscribe(phone)
        on.board.show([alarm("7")])
        await until(lambda: not on.devices(), "410")
        assert len(on.service.posted) == 2
        on.subscribe(phone)
        on.board.show([alarm("7"), alarm("8")])
        await until(lambda: len(on.service.posted) == 4, "the one that is sent elsewhere, again")
        assert phone.read(on.service.posted[3])["body"].startswith("Tag 8:")


async def test_a_message_waits_while_an_error_lasts_or_the_accounts_cannot_be_read(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    accounts, aside = tmp_path / "accounts.sqlite", tmp_path / "aside"

    def busy(posted: Posted) -> Iterator[bytes | None]:
        accounts.rename(aside)
        yield from status(503)(posted)

    async with pushing(tmp_path, busy, status(201)) as on:
        with pytest.MonkeyPatch.context() as broken:
            broken.setattr(push_module, "notes_of_alarms", None)
            on.board.show([alarm("7")])
            await until(lambda: on.push.condition.failed > 2, "attempts")
        assert caplog.text.count("Traceback") == 1
        await until(lambda: not on.push.condition.detail, "its end, with nobody to notify")
        on.subscribe(on.phone("one"))
        accounts.rename(aside)
        on.board.show([alarm("7"), alarm("8")])
        await until(lambda: "was not accepted: there is no file of accounts" in caplog.text, "why")
        aside.rename(accounts)
        await until(lambda: on.service.posted, "the first attempt")
        await until(lambda: "will be retried: there is no file of accounts" in caplog.text, "why")
        aside.rename(accounts)
        await until(lambda: len(on.service.posted) == 2, "the next attempt")


def test_damp_air_is_one_line_whatever_sensors_tell_of_it() -> None:
    page = PageText("en", Criteria.of(Settings()))
    assert push_text(damp_air("7"), page, "robot") == ("Alarm", "Tag 7: Air too damp (stressed)")
    title, body = push_text((*damp_air("7"), *map(alarm, "123456")), page, "simulated")
    assert title == "Simulated: Alarms: 7"
    assert body.endswith("Tag 3: Temperature too low (critical)\nNot listed: 3 more.")


async def test_a_browser_that_unsubscribes_meanwhile_is_not_tried_again(tmp_path: Path) -> None:
    def switched_off(posted: Posted) -> Iterator[bytes | None]:
        with changing(tmp_path / "accounts.sqlite") as accounts:
            accounts.remove_device(one.endpoint)
        yield from status(503)(posted)

    async with pushing(tmp_path, switched_off, status(201)) as on:
        one, other = on.phone("one"), on.phone("other")
        on.subscribe(one)
        on.board.show([alarm("7")])
        await until(lambda: on.service.posted, "the first try")
        await until(lambda: on.push.condition.waiting == 0, "the end of its attempts")
        on.subscribe(other)
        on.board.show([alarm("7"), alarm("8")])
        await until(lambda: on.posted_to(other), "the next alarm")
        assert len(on.posted_to(one)) == 1


async def test_names_that_never_resolve_hold_up_no_other_phone_and_no_webhook(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_over, resolve = Event(), socket.getaddrinfo

    def hang(host: Any, *more: Any, **named: Any) -> Any:
        if "hang" in host:
            is_over.wait(PATIENCE_S)
        return resolve(host, *more, **named)

    monkeypatch.setattr(socket, "getaddrinfo", hang)
    asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(4))
    async with pushing(tmp_path, status(201)) as on:
        for number in range(MAX_DEVICES - 1):
            on.subscribe(Phone(f"https://hang{number}.example/"))
        on.subscribe(on.phone("one"))
        on.board.show([alarm("7")])
        await until(lambda: on.service.posted, "the message to the other phone")
        with receiver(status(204)) as hook:
            await post(Endpoint("localhost", hook.port, "/", "localhost"), {}, b"{}")
        is_over.set()


async def test_an_alarm_raised_while_the_log_is_read_at_the_start_is_new(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    notified: list[str] = []

    async def notify(_: Push, alarms: Mapping[str, Alarm]) -> None:
        notified.extend(it.tag_id for it in alarms.values())

    monkeypatch.setattr(Push, "notify", notify)
    monkeypatch.setattr(push_module, "TOGETHER_S", 0.0)
    source = source_of(AlarmBoard())
    source.ros_time_ns = None
    push = Push(PushTarget(CONTACT, frozenset(), ssl.create_default_context()), None, "")  # type: ignore[arg-type]
    push.start(source)
    source.ros_time_ns = NOW_NS + 1
    before, meanwhile = alarm("before", raised_ns=NOW_NS - 9 * S), alarm("meanwhile")
    push.on_alarms(Change((before, meanwhile), is_past=True))
    await until(lambda: notified == ["meanwhile"], "what is new")
    # The log is read again, since another journal starts.
    push.on_alarms(Change((before, meanwhile, alarm("again")), is_past=True))
    push.on_alarms(Change((alarm("later"),)))
    await until(lambda: notified == ["meanwhile", "later"], "the next one")
    await push.stop()


@dataclass
class Live(Stage):
    live: Bridge


@pytest.fixture(scope="module")
def open_to(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Live]:
    folder = tmp_path_factory.mktemp("push")
    with push_service(folder) as (on, ours):
        authority = folder / "ca.pem"
        ours.authority.cert_pem.write_to_path(str(authority))
        add(on.accounts, "token", scada="admin")
        options = ("--accounts", str(on.accounts), "--push-contact", CONTACT)
        private = ("--push-private-host", "localhost", "--ros-args", "-p", "journal:=off")
        trusts: Any = {"SSL_CERT_FILE": str(authority), "LUPIN_TOKEN": f"shared-{TOKEN}"}
        with bridge(*SOON, *options, *private, **trusts) as live:
            live.peer.wait_for_twin()
            bearer = {"Authorization": f"Bearer {TOKEN}"}
            # Alarms that are active at the start are not new.
            wait_for(
                lambda: live.get("/api/alarms", bearer).json()["source"] != "starting", "the alarms"
            )
            yield Live(on.service, on.accounts, live)


def subscribe(browser: httpx.Client, phone: Phone, language: str = "en") -> None:
    headers = {"Accept-Language": language}
    answer = browser.post("/api/push", json=phone.subscription, headers=headers)
    assert answer.status_code == 204, answer.text


def test_a_critical_alarm_reaches_exactly_the_browsers_that_may_have_it(open_to: Live) -> None:
    on = open_to
    annas, berts, gones = on.phone("anna"), on.phone("bert"), on.phone("gone")
    add(on.accounts, gone="viewer")
    with signed_in(on.live.url, "anna") as anna, signed_in(on.live.url, "bert") as bert:
        key = anna.get("/api/push").json()["public_key"]
        subscribe(anna, annas)
        subscribe(bert, berts, "de-AT, en;q=0.5")
        with signed_in(on.live.url, "gone") as gone:
            subscribe(gone, gones)
        remove(on.accounts, "gone")
        on.live.peer.observe(inspection("7", anomaly=True, bug_count=2))
        wait_for(lambda: on.posted_to(annas) and on.posted_to(berts), "both messages")
        [to_anna], [to_bert] = on.posted_to(annas), on.posted_to(berts)
        assert annas.read(to_anna) == {"title": "Alarm", "body": "Tag 7: Pest seen (critical)"}
        assert berts.read(to_bert)["body"] == "Messpunkt 7: Schädlinge gefunden (kritisch)"
        assert to_anna.headers["ttl"] == "3600"
        assert to_anna.headers["content-encoding"] == "aes128gcm"
        authorization = to_anna.headers["authorization"]
        assert authorization.endswith(f"k={key}")
        assert Vapid02.verify(authorization)
        for phone in (annas, berts):  # only she may remove hers
            bert.post("/api/push", json={"endpoint": phone.endpoint})
        on.live.peer.observe(inspection("8", anomaly=True, bug_count=1))
        wait_for(lambda: len(on.posted_to(annas)) == 2, "the next one")
        assert annas.read(on.posted_to(annas)[1])["body"].startswith("Tag 8:")
        anna.post("/api/push", json={"endpoint": annas.endpoint})
    assert len(on.posted_to(berts)) == 1
    assert not on.posted_to(gones), "their account has gone"
    modes = {stat.S_IMODE(it.stat().st_mode) for it in on.accounts.parent.glob("accounts.sqlite*")}
    assert modes == {0o600}, "the key is in it"


@pytest.mark.parametrize(
    "endpoint",
    [
        "http://push.example/x",
        "https://push.example:22/x",
        "https://anna:secret@push.example/x",
        "",
    ],
)
def test_an_address_of_no_push_service_is_refused(open_to: Live, endpoint: str) -> None:
    with signed_in_once(open_to.live) as anna:
        answer = anna.post("/api/push", json=Phone(endpoint).subscription)
    assert (answer.status_code, "endpoint" in answer.json()["detail"]) == (400, True), answer.text


@pytest.mark.parametrize(
    ("name", "value"), [("p256dh", "BAAA"), ("p256dh", "*"), ("auth", "AAAA"), ("auth", "ä")]
)
def test_an_invalid_key_is_refused(open_to: Live, name: str, value: str) -> None:
    given = open_to.phone("x").subscription
    given["keys"][name] = value
    with signed_in_once(open_to.live) as anna:
        answer = anna.post("/api/push", json=given)
    assert (answer.status_code, f"keys.{name}" in answer.text) == (400, True), answer.text


@pytest.mark.parametrize(
    "host",
    [
        *("127.0.0.1", "127.1", "0x7f.0.0.1", "169.254.169.254"),
        *("[::ffff:10.0.0.1]", "[64:ff9b::10.0.0.1]"),
    ],
)
def test_nothing_is_posted_to_a_host_that_leads_into_a_private_network(
    open_to: Live, host: str
) -> None:
    """Its address is checked before each post, and is the one that is connected to."""
    phone = Phone(f"https://{host}/x")
    with signed_in_once(open_to.live) as anna:
        before, posted = count(anna, "dropped"), len(open_to.service.posted)
        subscribe(anna, phone)
        open_to.live.peer.observe(inspection(f"at {host}", anomaly=True, bug_count=2))
        wait_for(lambda: count(anna, "dropped") == before + 1, "that it is given up")
        assert "is not a public address" in anna.get("/readyz").text + open_to.live.process.output
        anna.post("/api/push", json={"endpoint": phone.endpoint})
    assert len(open_to.service.posted) == posted


def count(client: httpx.Client, what: str) -> int:
    found = re.search(
        rf'lupin_outward_{what}(?:_total)?\{{channel="push"\}} ([0-9.]+)',
        client.get("/metrics").text,
    )
    assert found is not None
    return int(float(found[1]))


def test_without_an_account_there_are_no_notifications(open_to: Live) -> None:
    given = open_to.phone("x").subscription
    for token in (TOKEN, f"shared-{TOKEN}"):
        headers = {**OWN, "Authorization": f"Bearer {token}"}
        assert open_to.live.http.get("/api/push", headers=headers).json() == {"public_key": None}
        answer = open_to.live.http.post("/api/push", json=given, headers=headers)
        assert (answer.status_code, "require an account" in answer.text) == (403, True)
    assert open_to.live.http.post("/api/push", json=given, headers=OWN).status_code == 401


def test_notified_browsers_per_person_are_limited_and_the_audit_trail_has_each_once(
    open_to: Live,
) -> None:
    def added() -> int:
        with changing(open_to.accounts) as accounts:
            return [row.what for row in accounts.audited()].count("add device")

    before = added()
    with signed_in_once(open_to.live) as anna:
        for number in range(12):
            subscribe(anna, open_to.phone(f"many{number}"))
            subscribe(anna, open_to.phone(f"many{number}"))
        gone = {"endpoint": "https://push.example/"}
        answers = [anna.post("/api/push", json=gone) for _ in range(NOTE_BURST + 100)]
    assert len(open_to.devices()) == 10
    assert added() == before + 12
    assert "anna has written more than" in answers[-1].text, "or they would fill the trail"


def test_a_contact_is_an_address() -> None:
    assert "must be mailto:" in refused_start("--push-contact", "grower")
    assert "has no use" in refused_start("--push-private-host", "push.lan")
