"""How requests come in: past which proxies, and below which path.

A header may claim any address. X-Forwarded-For and X-Forwarded-Proto are believed of a proxy that
the operator has named, and of nobody else; what the claim replaces (`client` and `scheme` of the
scope) is what limits, logs, wrong tokens and the check of origins go by.

uvicorn's own middleware for this takes an address with a port, as some proxies write it, for a new
client each time, knows no IPv4 address on a socket that listens for IPv6, and reads the last line
of several alone.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from ipaddress import (
    IPv4Address,
    IPv4Network,
    IPv6Address,
    IPv6Network,
    ip_address,
    ip_network,
)
from typing import Final, Self

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from lupin_bridge.settings import SettingError, Settings

# RFC 3986: a path of plain segments, none of which is "." or "..", without a slash at its end.
_PREFIX: Final = re.compile(r"(?:/(?!\.{1,2}(?:/|$))[A-Za-z0-9._~-]+)+")
# "10.0.0.7:1234" and "[fd00::7]:1234", as some proxies write an address.
_WITH_PORT: Final = re.compile(r"\[(?P<v6>[^\]]+)\](?::\d+)?|(?P<v4>[\d.]+):\d+")


@dataclass(frozen=True, slots=True)
class Entrance:
    """The proxies whose word counts, and the path that the bridge is found below ("": none)."""

    proxies: tuple[IPv4Network | IPv6Network, ...] = ()
    path_prefix: str = ""

    @classmethod
    def of(cls, settings: Settings) -> Self:
        """From the settings.

        Raises:
            SettingError: a proxy that is no address or network, or a prefix that is no path.

        """
        prefix = settings.path_prefix
        if prefix and _PREFIX.fullmatch(prefix) is None:
            raise SettingError(
                f"{settings.called('path_prefix')} is {prefix[:128]!r}, must be a path such as "
                "/gh1, without a slash at its end"
            )
        called = settings.called("trusted_proxy")
        return cls(tuple(_network(text, called) for text in settings.trusted_proxy), prefix)

    def trusts(self, address: str) -> bool:
        """Whether this is a proxy whose word counts."""
        ip = _address(address)
        return ip is not None and any(ip in network for network in self.proxies)

    def client(self, peer: str, forwarded_for: Iterable[str]) -> str:
        """Who asks, by X-Forwarded-For in lines: the nearest address that is no trusted proxy.

        Each proxy adds at the right whom it got the request from; what stands to the left of the
        first stranger is the stranger's own claim. What is no address ends the search.
        """
        client = peer
        hops = [hop for line in forwarded_for for hop in line.split(",")]
        while hops and self.trusts(client):
            hop = _address(hops.pop())
            if hop is None:
                break
            client = str(hop)
        return client


class ComesIn:
    """ASGI middleware, the first of all: the client, the scheme and the path as they really are.

    A proxy may cut the prefix off or leave it on: either way `root_path` is the prefix and `path`
    has it, as ASGI wants it.
    """

    def __init__(self, app: ASGIApp, entrance: Entrance) -> None:
        self._app = app
        self._entrance = entrance

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on as whoever sent it meant it."""
        if scope["type"] in ("http", "websocket"):
            scope = {**scope, **self._believed(scope), **self._path(scope)}
        await self._app(scope, receive, send)

    def _believed(self, scope: Scope) -> dict[str, object]:
        peer = (scope.get("client") or ("", 0))[0]
        if not self._entrance.trusts(peer):
            return {}
        headers = Headers(scope=scope)
        client = self._entrance.client(peer, headers.getlist("x-forwarded-for"))
        believed: dict[str, object] = {"client": (client, 0)}
        # Of several, the nearest proxy's: it is the one that we know.
        proto = ",".join(headers.getlist("x-forwarded-proto")).rpartition(",")[2].strip().lower()
        if proto in ("http", "https"):
            is_socket = scope["type"] == "websocket"
            believed["scheme"] = proto.replace("http", "ws") if is_socket else proto
        return believed

    def _path(self, scope: Scope) -> dict[str, object]:
        prefix = self._entrance.path_prefix
        if not prefix:
            return {}
        path: str = scope["path"]
        has_it = path == prefix or path.startswith(f"{prefix}/")
        return {"root_path": prefix, "path": path if has_it else prefix + path}


def path_of(scope: Scope) -> str:
    """A request's path below the prefix: the bridge's own."""
    path: str = scope["path"]
    return path[len(scope.get("root_path", "")) :]


def _network(text: str, called: str) -> IPv4Network | IPv6Network:
    try:
        return ip_network(text.strip("[]"))
    except ValueError:
        raise SettingError(
            f"{called} is {text[:128]!r}, must be an address or a network, such as 10.0.0.7 or "
            "10.0.0.0/24"
        ) from None


def _address(text: str) -> IPv4Address | IPv6Address | None:
    text = text.strip()
    match = _WITH_PORT.fullmatch(text)
    if match is not None:
        text = match["v6"] or match["v4"]
    try:
        ip = ip_address(text.partition("%")[0])
    except ValueError:
        return None
    return ip.ipv4_mapped or ip if isinstance(ip, IPv6Address) else ip
