"""The access policy: which proxies are believed, and which hosts and origins are allowed.

Anybody may send X-Forwarded-For and X-Forwarded-Proto, so they are believed only from a proxy that
the operator has named. uvicorn's middleware then sets `client` and `scheme` of the scope by them,
which count for limits, logs, wrong tokens and the check of origins.

A browser sends any page's requests to a bridge that its machine can reach. Four rules keep foreign
pages from reading anything through it, or making it compute:

- Host: the name that the browser used has to be one of this bridge's. A page at evil.example whose
  name is made to resolve to 127.0.0.1 (DNS rebinding) is "same origin" to the browser; its Host
  header still says evil.example. IP addresses are allowed: nobody can point them elsewhere.
- Origin (RFC 6454): a request that a page makes in CORS mode, or for a WebSocket, names the page's
  origin. It has to be this bridge's own, or one that the operator has allowed.
- Sec-Fetch-Site (W3C Fetch Metadata): a request without Origin that a foreign page makes, for an
  `<img>` or an `<iframe>` say, is refused as well. The page could not read the answer, only
  make us compute it.
- Referer: without TLS, browsers send no Sec-Fetch headers to another machine. A request with a
  foreign Referer is then refused, unless it is for a page: that is what a link looks like, and none
  of our pages can be framed. A foreign page may suppress its Referer: then its request looks like a
  program's.

Programs other than browsers send none of Origin, Sec-Fetch-Site and Referer.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address, ip_network
from typing import Any, Final, Self

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from lupin_bridge.settings import UNIX, SettingError, Settings, unix_path

# RFC 3986: a path of plain segments, none of which is "." or "..", without a slash at its end.
_PATH_PREFIX: Final = re.compile(r"(?:/(?!\.{1,2}(?:/|$))[A-Za-z0-9._~-]+)+")
_HEADER: Final = re.compile(r"[A-Za-z][A-Za-z0-9-]{0,63}")
# Key in a request's state: whom a trusted proxy names.
PROXY_USER_KEY: Final = "proxy_user"


@dataclass(frozen=True, slots=True)
class Proxies:
    """The proxies whose headers count, and the path that the bridge is below ("": none).

    `trusted` are addresses and networks, and `UNIX`: whoever reaches a Unix socket is such a proxy.
    `user_header` is the one in which they name the person ("": none).
    """

    trusted: tuple[str, ...] = ()
    path_prefix: str = ""
    user_header: str = ""

    @classmethod
    def of(cls, settings: Settings) -> Self:
        """From the settings.

        Raises:
            SettingError: a proxy that is no address or network, or a prefix that is no path.

        """
        prefix = settings.path_prefix
        if prefix and _PATH_PREFIX.fullmatch(prefix) is None:
            raise settings.wrong(
                "path_prefix",
                f"is {prefix[:128]!r}, must be a path such as /gh1, without a slash at its end",
            )
        header = settings.proxy_user_header
        if header and _HEADER.fullmatch(header) is None:
            raise settings.wrong(
                "proxy_user_header",
                f"is {header[:128]!r}, must be a header's name, such as Remote-User",
            )
        called = settings.called("trusted_proxy")
        trusted = [each for text in settings.trusted_proxy for each in _networks(text, called)]
        if unix_path(settings.host) is not None:
            trusted.append(UNIX)
        if header and not trusted:
            raise settings.wrong(
                "proxy_user_header",
                "is given without --host unix:PATH or --trusted-proxy: no proxy is trusted",
            )
        return cls(tuple(trusted), prefix, header)


class BehindProxies:
    """ASGI middleware, before access control: sets client, scheme and path behind proxies.

    A proxy may strip the prefix or keep it: either way `root_path` is the prefix, and `path`
    includes it, as ASGI requires.
    """

    def __init__(self, app: ASGIApp, proxies: Proxies) -> None:
        self._app: Any = ProxyHeadersMiddleware(app, [*proxies.trusted])  # type: ignore[arg-type]
        self._proxies = proxies

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on with its client, scheme, user and path."""
        if scope["type"] in ("http", "websocket"):
            # Only the peer of a Unix socket has no address. Others may have an IPv4 one in the
            # spelling of a socket that listens for IPv6.
            peer = (scope.get("client") or ("", 0))[0]
            peer = str(_address(peer) or peer) or UNIX
            user = self._user(scope) if peer in self._app.trusted_hosts else {}
            # Of several proxies, the first has received the client's own request; of several lines
            # of a header, the middleware reads the last.
            said = [it for it in scope["headers"] if it[0] == b"x-forwarded-proto"][:1]
            first = [(name, value.partition(b",")[0]) for name, value in said]
            own = {"client": (peer, 0), "headers": [*scope["headers"], *first]}
            scope = {**scope, **own, **user, **self._path(scope)}
        await self._app(scope, receive, send)

    def _user(self, scope: Scope) -> dict[str, object]:
        """Whom the proxy names, for the state: nothing else reads the header."""
        header = self._proxies.user_header.lower().encode()
        named = [value for name, value in scope["headers"] if name == header]
        if not named:
            return {}
        # There are two if the proxy adds its line to the client's instead of replacing that.
        name = named[0].decode("latin-1").strip() if len(named) == 1 else ""
        return {"state": {**scope.get("state", {}), PROXY_USER_KEY: name}}

    def _path(self, scope: Scope) -> dict[str, object]:
        prefix = self._proxies.path_prefix
        if not prefix:
            return {}
        path: str = scope["path"]
        has_it = path == prefix or path.startswith(f"{prefix}/")
        return {"root_path": prefix, "path": path if has_it else prefix + path}


def path_of(scope: Scope) -> str:
    """A request's path below the prefix: the bridge's own."""
    path: str = scope["path"]
    return path[len(scope.get("root_path", "")) :]


def _networks(text: str, called: str) -> list[str]:
    """The network, and the same in the IPv6 spelling that a proxy may forward (`::ffff:`)."""
    try:
        found = ip_network(text.strip("[]"))
        mapped = f"::ffff:{found.network_address}/{96 + found.prefixlen}"
        return [str(found), *([mapped] if found.version == 4 else [])]
    except ValueError:
        raise SettingError(
            f"{called} is {text[:128]!r}, must be an address or a network, such as 10.0.0.7 or "
            "10.0.0.0/24"
        ) from None


def _address(text: str) -> IPv4Address | IPv6Address | None:
    try:
        ip = ip_address(text.strip().partition("%")[0])
    except ValueError:
        return None
    return ip.ipv4_mapped or ip if isinstance(ip, IPv6Address) else ip


_DEFAULT_PORTS: Final = {"http": "80", "https": "443"}
_AUTHORITY: Final = re.compile(
    r"(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(?::(?P<port>[0-9]{1,5}))?"
)
_ORIGIN: Final = re.compile(r"(?P<scheme>https?)://(?P<authority>[^/]+)/?", re.IGNORECASE)


def host_of(authority: str) -> str | None:
    """The host of a Host header, in lower case and without brackets; None: not a Host header."""
    match = _AUTHORITY.fullmatch(authority)
    return None if match is None else match["host"].strip("[]").rstrip(".").lower()


def parse_origin(text: str) -> str:
    """An origin as browsers write it: scheme and host in lower case, no default port, no slash.

    Raises:
        ValueError: it is none.

    """
    match = _ORIGIN.fullmatch(text)
    authority = None if match is None else _AUTHORITY.fullmatch(match["authority"])
    if match is None or authority is None:
        raise ValueError(
            f"{text[:128]!r} is not an origin, expected http:// or https://, a host and a port"
        )
    scheme, port = match["scheme"].lower(), authority["port"]
    suffix = "" if port is None or port == _DEFAULT_PORTS[scheme] else f":{port}"
    return f"{scheme}://{authority['host'].lower()}{suffix}"


def parse_host(text: str) -> str:
    """A host's name as `host_of` gives it.

    Raises:
        ValueError: it is none, or has a scheme or port.

    """
    match = _AUTHORITY.fullmatch(text)
    if match is None or match["port"] is not None:
        raise ValueError(
            f"{text[:128]!r} is not a host's name, expected it without scheme and port"
        )
    return match["host"].strip("[]").rstrip(".").lower()


@dataclass(frozen=True, slots=True)
class Decision:
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

    def judge(self, scheme: str, headers: Headers, *, wants_page: bool = False) -> Decision:
        """Decide whether a request may pass.

        `scheme` is http or https, for WebSockets too. `wants_page`: it may be a person who follows
        a link to one of our pages.
        """
        refusal = self._refusal_of_host(headers.getlist("host"))
        if refusal is not None:
            return Decision(refusal)
        own = f"{scheme}://{headers['host']}"
        if origins := headers.getlist("origin"):
            return self._judge_origin(" ".join(origins), own)
        referer = headers.get("referer", "")
        if site := headers.get("sec-fetch-site"):
            # A link shows our page to a person, and not to the page with the link. A frame or an
            # object is a navigation too, but the person need not see anything of it.
            how = headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")
            if site in ("cross-site", "same-site") and how != ("navigate", "document"):
                return Decision(
                    "a page of another origin sends a request without naming itself: load it in"
                    " CORS mode (<img crossorigin>, or fetch) and start the bridge with"
                    " --allow-origin for it"
                )
        elif referer and not wants_page:
            return self._judge_origin("/".join(referer.split("/", 3)[:3]), own)
        return Decision()

    def _refusal_of_host(self, hosts: Sequence[str]) -> str | None:
        if len(hosts) != 1:
            return f"the request has {len(hosts)} Host headers, expected one"
        host = host_of(hosts[0])
        if host is None:
            return f"Host is {hosts[0][:128]!r}, expected a host and a port"
        # RFC 6761, section 6.3: localhost and what is below it never leave the machine.
        is_local = host == "localhost" or host.endswith(".localhost") or _address(host)
        if not is_local and host not in self._hosts:
            return (
                f"this bridge is not known by the name {host[:128]!r}: use its IP address, or "
                f"start it with --allow-host {host[:128]}"
            )
        return None

    def _judge_origin(self, named: str, own: str) -> Decision:
        try:
            origin = parse_origin(named)
        except ValueError:
            # "null", for one: a page from a file, or in a sandbox.
            return Decision(f"pages of the origin {named[:128]!r} may not read this bridge")
        if origin == parse_origin(own):
            return Decision()
        if origin in self.origins:
            return Decision(foreign=origin)
        return Decision(
            f"pages of the origin {origin[:128]!r} may not read this bridge: to let them, start it "
            f"with --allow-origin {origin[:128]}"
        )


def exposure(address: str, *, has_token: bool, has_tls: bool) -> list[str]:
    """What an operator should know about listening on `address`, as warnings."""
    ip = _address(address)
    if ip is not None and ip.is_loopback:
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
