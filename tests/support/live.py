"""`lupin-twin web` processes, attached to twins in their own processes."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import httpx

from tests.support.domains import own_domain
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge


@contextmanager
def attached(process: Process, peer: Peer) -> Iterator[Bridge]:
    """A bridge's process with an HTTP client; a twin need not exist."""
    with httpx.Client(base_url=url_of(process), timeout=PATIENCE_S, trust_env=False) as http:
        yield Bridge(process, str(http.base_url).rstrip("/"), peer, http)


@contextmanager
def serve_and_web(
    *options: str, of_both: Sequence[str] = (), afresh: bool = False, **env: str
) -> Iterator[tuple[Bridge, Bridge]]:
    """`serve` with these options and this environment, and a `web` of its twin."""
    with (
        own_domain() as domain,
        bridge(*of_both, *options, domain=domain, afresh=afresh, **env) as twin,
        lupin_twin(domain, "web", *of_both, afresh=afresh) as process,
        attached(process, twin.peer) as apart,
    ):
        yield twin, apart


def wait_until_ready(live: Bridge) -> None:
    wait_for(lambda: live.get("/readyz").status_code == 200, f"a live twin behind {live.url}")


def field_of(live: Bridge, **request: Any) -> httpx.Response:
    """The answer with a field, once the bridge has found the twin's service.

    It receives a twin's states before that, and a dead twin may still seem to offer its service.
    """

    def check() -> httpx.Response | None:
        answer = live.get("/api/field", **request)
        return answer if answer.status_code == 200 else None

    found = wait_for(check, f"a field at {live.url}")
    assert found is not None
    return found
