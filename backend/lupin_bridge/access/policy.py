"""Who may read, by a request's Host, Origin, Sec-Fetch and Referer headers. Pure.

A browser will carry any page's request to a bridge that its machine can reach. Four rules keep
foreign pages from reading, or computing, anything through it:

- Host: the name that the browser used has to be one of this bridge's. A page at evil.example whose
  name is made to resolve to 127.0.0.1 (DNS rebinding) is "same origin" to the browser; its Host
  header still says evil.example. An IP address is nobody's name to point elsewhere.
- Origin (RFC 6454): a request that a page makes in CORS mode, or for a WebSocket, names the page's
  origin. It has to be this bridge's own, or one that the operator has allowed.
- Sec-Fetch-Site (W3C Fetch Metadata): a request without Origin that a foreign page makes, for an
  `<img>` or an `<iframe>` say, is turned away as well. The page could not read the answer, only
  make us compute it.
- Referer: beyond this machine and without TLS, browsers send no Sec-Fetch headers. What is no page
  is then refused to whoever names a foreign page as where it comes from. A page passes, for that is
  what a link looks like; none of ours can be framed. A foreign page may keep its name to itself:
  nothing tells its request from a program's then.

Programs other than browsers send none of Origin, Sec-Fetch-Site and Referer.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final

_DEFAULT_PORTS: Final = {"http": "80", "https": "443"}
_AUTHORITY: Final = re.compile(
    r"(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(?::(?P<port>[0-9]{1,5}))?"
)
_ORIGIN: Final = re.compile(r"(?P<scheme>https?)://(?P<authority>[^/]+)/?", re.IGNORECASE)


class OriginError(ValueError):
    """Not an origin; the message says what was expected and got."""


class HostError(ValueError):
    """Not a host's name; the message says what was expected and got."""


def host_of(authority: str) -> str | None:
    """The host of a Host header, in lower case and without brackets; None: not a Host header."""
    match = _AUTHORITY.fullmatch(authority)
    return None if match is None else match["host"].strip("[]").rstrip(".").lower()


def parse_origin(text: str) -> str:
    """An origin as browsers write it: scheme and host in lower case, no default port, no slash.

    Raises:
        OriginError: it is none.

    """
    match = _ORIGIN.fullmatch(text)
    authority = None if match is None else _AUTHORITY.fullmatch(match["authority"])
    if match is None or authority is None:
        raise OriginError(
            f"{text[:128]!r} is not an origin, expected http:// or https://, a host and a port"
        )
    scheme, port = match["scheme"].lower(), authority["port"]
    suffix = "" if port is None or port == _DEFAULT_PORTS[scheme] else f":{port}"
    return f"{scheme}://{authority['host'].lower()}{suffix}"


def parse_host(text: str) -> str:
    """A host's name as `host_of` gives it.

    Raises:
        HostError: it is none, or has a scheme or port.

    """
    match = _AUTHORITY.fullmatch(text)
    if match is None or match["port"] is not None:
        raise HostError(f"{text[:128]!r} is not a host's name, expected it without scheme and port")
    return match["host"].strip("[]").rstrip(".").lower()


@dataclass(frozen=True, slots=True)
class Asked:
    """What a request says of where it comes from; headers in the order of their appearance.

    `scheme` is http or https, for WebSockets too; the values of Sec-Fetch headers and Referer are
    "" if absent. `wants_page`: it may be a person who follows a link to one of our pages.
    """

    scheme: str
    hosts: Sequence[str]
    origins: Sequence[str] = ()
    fetch_site: str = ""
    fetch_mode: str = ""
    fetch_dest: str = ""
    referer: str = ""
    wants_page: bool = False


@dataclass(frozen=True, slots=True)
class Verdict:
    """`refusal` is None where the request may pass; `foreign` is the allowed foreign origin."""

    refusal: str | None = None
    foreign: str | None = None


class AccessPolicy:
    """The hosts that this bridge goes by, and the origins whose pages may read it."""

    def __init__(
        self,
        host: str = "127.0.0.1",
        allowed_origins: Iterable[str] = (),
        allowed_hosts: Iterable[str] = (),
    ) -> None:
        self.origins: Final = frozenset(parse_origin(origin) for origin in allowed_origins)
        named = (host_of(origin.partition("://")[2]) for origin in self.origins)
        self._hosts = {host.rstrip(".").lower(), *named, *map(parse_host, allowed_hosts)}

    def judge(self, asked: Asked) -> Verdict:
        """Whether a request may pass."""
        refusal = self._refusal_of_host(asked.hosts)
        return Verdict(refusal) if refusal is not None else self._judge_page(asked)

    def _refusal_of_host(self, hosts: Sequence[str]) -> str | None:
        if len(hosts) != 1:
            return f"the request has {len(hosts)} Host headers, expected one"
        host = host_of(hosts[0])
        if host is None:
            return f"Host is {hosts[0][:128]!r}, expected a host and a port"
        if not self._goes_by(host):
            return (
                f"this bridge is not known by the name {host[:128]!r}: use its IP address, or "
                f"start it with --allow-host {host[:128]}"
            )
        return None

    def _judge_page(self, asked: Asked) -> Verdict:
        if asked.origins:
            return self._judge_origin(" ".join(asked.origins), asked)
        if asked.fetch_site:
            # A link shows our page to a person; the page that led there does not see it. A frame,
            # or an object, is a navigation too, of which the person need not see anything.
            is_link = asked.fetch_mode == "navigate" and asked.fetch_dest == "document"
            if asked.fetch_site in ("cross-site", "same-site") and not is_link:
                return Verdict(
                    "a page of another origin asks without naming itself: load it in CORS mode "
                    "(<img crossorigin>, or fetch) and start the bridge with --allow-origin for it"
                )
        elif asked.referer and not asked.wants_page:
            return self._judge_origin("/".join(asked.referer.split("/", 3)[:3]), asked)
        return Verdict()

    def _goes_by(self, host: str) -> bool:
        # RFC 6761, section 6.3: localhost and what is below it never leave the machine.
        return (
            host in self._hosts
            or host == "localhost"
            or host.endswith(".localhost")
            or _is_ip(host)
        )

    def _judge_origin(self, named: str, asked: Asked) -> Verdict:
        try:
            origin = parse_origin(named)
        except OriginError:
            # "null", for one: a page from a file, or in a sandbox.
            return Verdict(f"pages of the origin {named[:128]!r} may not read this bridge")
        if origin == parse_origin(f"{asked.scheme}://{asked.hosts[0]}"):
            return Verdict()
        if origin in self.origins:
            return Verdict(foreign=origin)
        return Verdict(
            f"pages of the origin {origin[:128]!r} may not read this bridge: to let them, start it "
            f"with --allow-origin {origin[:128]}"
        )


def exposure(address: str, *, has_token: bool, has_tls: bool) -> list[str]:
    """What whoever starts the bridge should know about listening on `address`, as warnings."""
    if _is_ip(address) and ip_address(address).is_loopback:
        return []
    warnings = []
    if not has_token:
        warnings.append(
            f"listening on {address} without LUPIN_TOKEN or --token-file: anyone who reaches this "
            "port reads everything the twin knows"
        )
    if not has_tls:
        warnings.append(
            f"listening on {address} without --tls-cert and --tls-key: anyone on the way reads "
            f"along{', the token too' if has_token else ''}"
        )
    return warnings


def _is_ip(host: str) -> bool:
    try:
        ip_address(host)
    except ValueError:
        return False
    return True
