"""How long until clients know: the twin stopped, killed and back, the bridge killed and back.

In `lupin-twin web`, whose twin is a process of its own. The contract: the truth within 3.5 s.
"""

from __future__ import annotations

import time

import httpx

from tests.support.domains import own_domain
from tests.support.live import attached
from tests.support.processes import lupin_twin, twin_node, url_of
from tests.support.ros import Peer
from tests.support.web import Listener, listener


def measure_outages() -> str:
    """One line for each outage: seconds until a client was told, and until all was well again."""
    with (
        own_domain() as domain,
        Peer(domain) as peer,
        lupin_twin(domain, "web") as bridge,
        twin_node(domain) as twin,
        attached(bridge, peer) as live,
        live.listen() as client,
    ):
        told(client, "live")
        twin.freeze()
        stopped_s = told(client, "offline")
        twin.thaw()
        continued_s = told(client, "live")
        twin.kill()
        killed_s = told(client, "offline")
        start_s = time.monotonic()
        with twin_node(domain):
            told(client, "live")
            restarted_s = time.monotonic() - start_s
            port = str(httpx.URL(live.url).port)
            bridge.kill()
            start_s = time.monotonic()
            with lupin_twin(domain, "web", "--port", port) as again:
                url_of(again)
                with listener(live.url) as back:
                    back.until("state")
                bridge_s = time.monotonic() - start_s
    lines = (
        "Outages behind `lupin-twin web`, s:",
        f"- twin stopped: told after {stopped_s:.1f}; continued: live after {continued_s:.1f}",
        f"- twin killed: told after {killed_s:.1f}; started again: live after {restarted_s:.1f}",
        f"- bridge killed and started again: a client has the state after {bridge_s:.1f}",
    )
    return "\n".join(lines)


def told(client: Listener, twin: str) -> float:
    """Seconds from now until the client is told that the twin is live or offline."""
    start_s = time.monotonic()
    client.until("status", lambda frame: frame["twin"] == twin)
    return time.monotonic() - start_s
