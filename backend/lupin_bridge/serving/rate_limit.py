"""How often each client may do something: token buckets in a bounded table. Pure.

The clock is an argument: seconds that never jump.
"""

from __future__ import annotations

from collections import OrderedDict
from ipaddress import IPv6Address, ip_address
from typing import Final

# One entry is an address and a number: some hundred kilobytes when the table is full.
MAX_CLIENTS: Final = 4_096

# Sums of float intervals miss a whole burst by less than this.
_NOISE_S: Final = 1e-9


class RateLimit:
    """At most `rate_hz` in the long run and `burst` at once, for each client by itself.

    Generic cell rate algorithm (ITU-T I.371): what is kept of a client is the one moment at which
    its bucket will be full again. A client that reached that moment is as one never seen; the
    least recently active leaves a full table first.
    """

    def __init__(self, rate_hz: float, burst: float, max_clients: int = MAX_CLIENTS) -> None:
        self._interval_s = 1.0 / rate_hz
        self._slack_s = (max(1.0, burst) - 1.0) / rate_hz
        self._max_clients = max_clients
        self._full_at_s: OrderedDict[str, float] = OrderedDict()

    def __len__(self) -> int:
        return len(self._full_at_s)

    def wait_s(self, client: str, now_s: float) -> float:
        """How long until the client's next turn, s; 0: now."""
        wait = self._full_at_s.get(client, now_s) - self._slack_s - now_s
        return wait if wait > _NOISE_S else 0.0

    def take(self, client: str, now_s: float) -> float:
        """Take a turn if there is one; returns `wait_s`, and more than 0 means: not taken."""
        wait = self.wait_s(client, now_s)
        if wait == 0.0:
            full_at = max(self._full_at_s.get(client, now_s), now_s)
            self._full_at_s[client] = full_at + self._interval_s
            self._full_at_s.move_to_end(client)
            if len(self._full_at_s) > self._max_clients:
                self._full_at_s.popitem(last=False)
        return wait


def client_key(address: str) -> str:
    """The client that an address stands for.

    An IPv6 host has a whole /64 to itself (RFC 6177) and may change within it as it likes; an IPv4
    address has a second spelling on a socket that listens for both.
    """
    try:
        ip = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if not isinstance(ip, IPv6Address):
        return str(ip)
    if ip.ipv4_mapped is not None:
        return str(ip.ipv4_mapped)
    return f"{IPv6Address(int(ip) >> 64 << 64)}/64"
