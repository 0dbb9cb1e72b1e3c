"""Dear questions of some clients and what everybody asks for: nobody waits behind them."""

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import AsyncExitStack

import httpx
import pytest

from lupin_bridge.serving.admission import Limits
from tests.support.domains import own_domain
from tests.support.journal import NOW, SECOND, kept, scan
from tests.support.processes import OFTEN, Process, limits, lupin_twin, url_of
from tests.support.waiting import PATIENCE_S, until

TAGS, SCANS = 30, 1_000
BEGUN_S = NOW // SECOND - SCANS * 600
TINY = f"/api/history?tag_id=3&sensor_type=temperature&points=10&from={BEGUN_S}&to={BEGUN_S + 6000}"


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Process]:
    """`serve` with a week in its journal, and all the time there is for an answer."""
    journal = tmp_path_factory.mktemp("journal") / "twin.sqlite"
    kept(
        journal,
        [
            scan(str(tag), (BEGUN_S + number * 600 + tag) * SECOND)
            for number in range(SCANS)
            for tag in range(TAGS)
        ],
    )
    patient = limits(answer_timeout_s=600)
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *patient, *OFTEN, "-p", f"journal:={journal}") as process,
    ):
        yield process


def timeline(number: int) -> str:
    """A dear question that is like no other."""
    return f"/api/timeline?points=5000&from={BEGUN_S + number}&to={NOW // SECOND}"


class Clients:
    """HTTP clients that each come from an address of their own."""

    def __init__(self, url: str, stack: AsyncExitStack) -> None:
        self._url, self._stack = url, stack
        self._number = 0

    async def new(self) -> httpx.AsyncClient:
        self._number += 1
        transport = httpx.AsyncHTTPTransport(local_address=f"127.0.7.{self._number}")
        client = httpx.AsyncClient(
            base_url=self._url, transport=transport, timeout=PATIENCE_S, trust_env=False
        )
        return await self._stack.enter_async_context(client)


def test_a_tiny_question_and_the_state_pass_all_that_six_clients_may_ask(house: Process) -> None:
    async def run() -> None:
        async with AsyncExitStack() as stack:
            clients = Clients(url_of(house), stack)
            modest = await clients.new()
            assert (await modest.get(TINY)).status_code == 200  # the process that looks back is up
            each = Limits().concurrency
            asked = {
                asyncio.create_task(client.get(timeline(each * number + n))): number
                for number in range(6)
                for client in [await clients.new()]
                for n in range(each)
            }

            def count(status: int) -> int:
                return sum(task.done() and task.result().status_code == status for task in asked)

            await until(lambda: count(503), "all places to be taken")
            state = await modest.get("/api/state")
            tiny = await modest.get(TINY.replace("points=10", "points=9"))
            assert (state.status_code, tiny.status_code) == (200, 200)
            answered = count(200)
            answers = await asyncio.gather(*asked)
            assert {answer.status_code for answer in answers} == {200, 503}
            served = Counter(asked[task] for task in asked if task.result().status_code == 200)
            assert len(served) == 6, "each client has had an answer"
            assert answered < served.total() / 2, "it waited for few of them"

    asyncio.run(run())
