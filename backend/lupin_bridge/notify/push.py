"""Web Push (RFC 8030): critical alarms on the phones and browsers of people who want them.

The address to post to comes from a browser, so it may be any address. So posts go only by https to
port 443 of public addresses, without redirects, and little of an answer is read. A message is
encrypted for its browser alone (RFC 8291, by `http_ece`) and signed with a key of this bridge
(VAPID, RFC 8292, by `py_vapid`). `pywebpush` adds to these two a client that follows redirects, and
posts to any address.
"""

from __future__ import annotations

import asyncio
import math
import socket
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from ipaddress import IPv4Address, ip_address, ip_network
from socket import SOCK_STREAM
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

import orjson

from lupin_bridge.access.accounts import Device
from lupin_bridge.access.credentials import AccountError
from lupin_bridge.access.people import People
from lupin_bridge.alarms.board import NOTHING_SAID, Change, notes_of_alarms
from lupin_bridge.feed.tasks import Guard, end
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.notify.destinations import Endpoint, PushTarget, address_of, path_of
from lupin_bridge.notify.messages import Backoff, Condition, Source
from lupin_bridge.notify.webhook import AlarmNews, PostError, post, until_taken
from lupin_bridge.past.report_page import PageText
from lupin_bridge.serving.admission import AdmissionError
from lupin_bridge.stream.state_json import alarm_json, by_cause
from lupin_twin.core.diagnostics import Origin

if TYPE_CHECKING:
    from py_vapid import Vapid02

# Alarms that come within this time of each other are one notification, s.
TOGETHER_S: Final = 2.0
# How long a push service keeps a message for a phone that is off, s; older ones are on the page.
TTL_S: Final = 3_600
# Attempts to send a message: they take most of that hour, as a greenhouse may be offline for long.
MAX_ATTEMPTS: Final = 66
# Between the first two attempts, and between later ones, s.
FIRST_WAIT_S: Final = 2.0
MOST_WAIT_S: Final = 60.0
# Lines of one notification, each of one cause at a tag.
MAX_PUSHED: Final = 4
# Posts at once, to however many browsers.
AT_ONCE: Final = 8
# Threads of its own that look up names, more than an account has devices: a name server that never
# answers blocks one for half a minute.
LOOKUPS: Final = 32
# A gateway translates these to the IPv4 address in their last four bytes (NAT64, RFC 6052).
_NAT64: Final = ip_network("64:ff9b::/96")
_GONE: Final = (404, 410)
_KEY: Final = "vapid"


class DeviceRefused(ValueError):
    """A device cannot be notified; the message names the field."""


class DeviceGone(Exception):
    """A device is no longer known to its push service."""


class Push:
    """Sends critical alarms to devices. Belongs to the event loop.

    `people` has the devices, `site` is the site of the alarms.
    """

    name: Final = "push"

    def __init__(self, target: PushTarget, people: People, site: str) -> None:
        self.condition = Condition(is_connected=True)
        self.target, self._people, self._site = target, people, site
        self._vapid: Vapid02 | None = None
        self._news = AlarmNews()
        self._has_read = False
        self._new: dict[str, Alarm] = {}
        self._is_news = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        # By endpoint: the alarms still to be sent, and the task that sends them.
        self._owed: dict[str, dict[str, Alarm]] = {}
        self._sending: dict[str, asyncio.Task[None]] = {}
        self._at_once = asyncio.Semaphore(AT_ONCE)
        self._lookups = ThreadPoolExecutor(LOOKUPS, thread_name_prefix="push")
        known = AccountError, AdmissionError, DeviceRefused
        self._guard = Guard("a push notification was not accepted", *known)
        self._source: Source
        self._started_s = 0.0

    async def public_key(self) -> str:
        """The key that a browser subscribes with, base64url; it is made at the first call.

        Raises:
            AccountError, ClientLimitError: the file of people cannot be written.

        """
        from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat  # noqa: PLC0415  # few want it
        from py_vapid.utils import b64urlencode  # noqa: PLC0415

        key = (await self._key()).public_key
        raw = key.public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)
        return str(b64urlencode(raw))

    async def _key(self) -> Vapid02:
        from py_vapid import Vapid02  # noqa: PLC0415  # as above

        def make() -> str:
            made = Vapid02()
            made.generate_keys()
            return str(made.private_pem().decode())

        if self._vapid is None:
            pem = await self._people.write(lambda it, _: it.kept(_KEY, make))
            self._vapid = Vapid02.from_pem(pem.encode())
        return self._vapid

    def start(self, source: Source) -> None:
        """Notify of critical alarms from now on."""
        self._source, self._started_s = source, time.monotonic()
        self._task = asyncio.create_task(self._run(), name="push")

    def on_alarms(self, change: Change) -> None:
        """Queue changed alarms that are critical, and new or worse."""
        source, since_ns = self._source, 0.0
        now_ns = source.ros_time_ns
        if change.is_past:
            # Alarms of the log are not new, except those raised while it is read at the start.
            if self._has_read or now_ns is None:
                since_ns = math.inf
            else:
                since_ns = now_ns - (time.monotonic() - self._started_s) * 1e9
            self._has_read = True
        for it in self._news.of(change, now_ns):
            for alarm in (it.alarm, *it.also) if it.change in ("raised", "worse") else ():
                at_ns = alarm.worse_at_ns or alarm.raised_at_ns
                if at_ns >= since_ns and alarm.reason.verdict is Verdict.CRITICAL:
                    self._new[alarm.id] = alarm
                    self._is_news.set()

    async def stop(self) -> None:
        """End at once."""
        for task in (self._task, *self._sending.values()):
            await end(task)

    async def _run(self) -> None:
        has_failed = False
        while True:
            await self._is_news.wait()
            await asyncio.sleep(TOGETHER_S)
            self._is_news.clear()
            alarms, self._new = self._new, {}
            error = await self._guard.run(self.notify(alarms))
            if error is not None:
                self.condition.failing(str(error))
                self._new = alarms | self._new
                self._is_news.set()
            elif has_failed:
                self.condition.taken(0)
            has_failed = error is not None

    async def notify(self, alarms: dict[str, Alarm]) -> None:
        """Send alarms, by their ids, to all devices, but for shelved ones."""
        source = self._source
        notes = source.notes.notes or ()
        said = notes_of_alarms(source.alarms.now.alarms, notes, source.ros_time_ns)
        wanted = {k: v for k, v in alarms.items() if said.get(k, NOTHING_SAID).shelved is None}
        if not wanted:
            return
        for device in await self._devices():
            endpoint = device.endpoint
            self._owed.setdefault(endpoint, {}).update(wanted)
            if endpoint not in self._sending:
                self._sending[endpoint] = asyncio.create_task(self._serve(device))
        self.condition.waiting = len(self._sending)

    async def _devices(self) -> Sequence[Device]:
        return await self._people.write(lambda it, _: it.devices(self._site))

    async def _serve(self, device: Device) -> None:
        """Send a browser all that is due to it; no other browser waits for that."""
        error = await self._guard.run(self._send_owed(device))
        if error is not None:
            self.condition.failing(str(error))
            self.condition.dropped += 1
        self._owed.pop(device.endpoint, None)
        del self._sending[device.endpoint]
        self.condition.waiting = len(self._sending)

    async def _send_owed(self, device: Device) -> None:
        source = self._source
        while owed := self._owed.pop(device.endpoint, None):
            page = PageText(device.language, source.criteria)
            title, body = push_text(owed.values(), page, source.origin)
            title = f"{self._site}: {title}" if self._site else title
            await self._send(device, orjson.dumps({"title": title, "body": body}))

    async def _send(self, device: Device, message: bytes) -> None:
        """Post until the push service takes it, no longer knows the device, or was tried enough."""

        async def attempt() -> None:
            try:
                endpoint = await self._endpoint(device.endpoint)
                headers, body = await self._headers(endpoint), encrypted(device, message)
                async with self._at_once:
                    # Its owner may have switched it off since the last attempt.
                    if all(it.endpoint != device.endpoint for it in await self._devices()):
                        raise DeviceGone
                    await post(endpoint, headers, body)
            except PostError as error:
                if error.status in _GONE:
                    raise DeviceGone from None
                raise
            except (AccountError, AdmissionError) as error:
                raise PostError(str(error)) from error

        backoff = Backoff(FIRST_WAIT_S, MOST_WAIT_S)
        try:
            what, where = "a push notification", urlsplit(device.endpoint).hostname or ""
            await until_taken(
                attempt, self.condition, backoff, what, where, max_attempts=MAX_ATTEMPTS
            )
        except DeviceGone:
            await self._people.write(lambda it, _: it.remove_device(device.endpoint))

    async def _headers(self, endpoint: Endpoint) -> dict[str, str]:
        claims = {
            "aud": f"https://{endpoint.authority}",
            "sub": self.target.contact,
            "exp": int(time.time()) + 12 * 3600,
        }
        signed: dict[str, str] = (await self._key()).sign(claims)
        return {
            **signed,
            "Content-Type": "application/octet-stream",
            "Content-Encoding": "aes128gcm",
            "TTL": str(TTL_S),
            "Urgency": "high",
            "Topic": "lupin-twin-alarms",
        }

    async def _endpoint(self, url: str) -> Endpoint:
        """Where to connect to: an IP address that was checked, which no later lookup can change."""
        endpoint = parsed(url, self.target)
        try:
            found = await asyncio.get_running_loop().run_in_executor(
                self._lookups, socket.getaddrinfo, endpoint.host, endpoint.port, 0, SOCK_STREAM
            )
        except (OSError, UnicodeError):
            raise PostError("its host is not known") from None
        addresses = [str(address[0]) for *_, address in found]
        for address in addresses:
            if not is_public(address) and endpoint.host not in self.target.private_hosts:
                raise DeviceRefused(
                    f"{address} of {endpoint.host} is not a public address, see --push-private-host"
                )
        return replace(endpoint, address=addresses[0])


def push_text(alarms: Iterable[Alarm], page: PageText, origin: Origin) -> tuple[str, str]:
    """Title and text of a notification of alarms: a line for each cause at a tag."""
    found = by_cause(map(alarm_json, alarms))
    title = page.say("alarm") if len(found) == 1 else f"{page.say('alarms')}: {len(found)}"
    lines = [page.alarm(entry) for entry in found[:MAX_PUSHED]]
    if len(found) > MAX_PUSHED:
        lines.append(page.say("more", count=len(found) - MAX_PUSHED))
    of = page.words["origins"].get(origin, "")
    # A tag's name may be long, a push service takes 4 kB.
    return f"{of}: {title}" if of else title, "\n".join(line[:200] for line in lines)


def parsed(url: str, target: PushTarget) -> Endpoint:
    """The parts of a push service's address, which a browser gave.

    Raises:
        DeviceRefused: it is invalid.

    """
    try:
        parts, port = address_of(url, {"https": 443})
    except ValueError as error:
        raise DeviceRefused(f"endpoint {error}") from None
    host = parts.hostname or ""
    if port != 443 and host not in target.private_hosts:
        raise DeviceRefused(f"endpoint has the port {port}, expected 443")
    return Endpoint(host, port, path_of(parts), parts.netloc, target.tls)


def is_public(host: str) -> bool:
    """Whether an address is reached over the internet alone; NAT64 leads to an IPv4 address."""
    found = ip_address(host.partition("%")[0])
    return (IPv4Address(found.packed[-4:]) if found in _NAT64 else found).is_global


def check_device(device: Device, target: PushTarget) -> None:
    """Refuse a device that can never be notified.

    Raises:
        DeviceRefused: the address or a key is invalid.

    """
    from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, EllipticCurvePublicKey  # noqa: PLC0415  # as above

    parsed(device.endpoint, target)  # its address is checked at each post
    try:
        EllipticCurvePublicKey.from_encoded_point(SECP256R1(), _decoded(device.public_key))
    except ValueError:
        raise DeviceRefused("keys.p256dh: expected a point of P-256, base64url") from None
    with suppress(ValueError):
        if len(_decoded(device.secret)) == 16:
            return
    raise DeviceRefused("keys.auth: expected 16 bytes, base64url")


def _decoded(text: str) -> bytes:
    from py_vapid.utils import b64urldecode  # noqa: PLC0415  # as above

    raw: bytes = b64urldecode(text.encode())
    return raw


def encrypted(device: Device, message: bytes) -> bytes:
    """A message that only this browser can read."""
    import http_ece  # noqa: PLC0415  # as above
    from cryptography.hazmat.primitives.asymmetric import ec  # noqa: PLC0415

    body: bytes = http_ece.encrypt(
        message,
        private_key=ec.generate_private_key(ec.SECP256R1()),
        dh=_decoded(device.public_key),
        auth_secret=_decoded(device.secret),
        version="aes128gcm",
    )
    return body
