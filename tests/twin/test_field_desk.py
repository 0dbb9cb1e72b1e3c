from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from lupin_twin.field_desk import MAX_FIELDS, MAX_WAITING, FieldDesk
from lupin_twin.fields import (
    FieldCache,
    FieldEngine,
    FieldJob,
    FieldRefused,
    FieldRequest,
    FieldRules,
)
from lupin_twin.grid import FieldGrid
from lupin_twin.state import TwinStore
from lupin_twin.workers import Workers
from tests.support.waiting import wait_for

RULES = FieldRules(2.0, 1.5, 1.5, 1_000)


class Desk:
    """A desk whose workers stand still until `go` is set."""

    def __init__(self) -> None:
        self.engine = FieldEngine(RULES, FieldCache(max_bytes=10**6))
        self.store = TwinStore()
        self.workers = Workers("test")
        self.woken = threading.Event()
        self.go = threading.Event()
        for _ in range(3):
            self.workers.submit(lambda _: self.go.wait())
        self.desk = FieldDesk(self.engine, self.workers, self.woken.set)
        self.answers: list[FieldGrid | Exception] = []

    def job(self, min_x: float = 0.0, **changes: Any) -> FieldJob:
        request = FieldRequest("co2", 0.5, min_x, 0.0, min_x + 2.0, 2.0)
        job = self.engine.lookup(request, self.store, None)
        assert isinstance(job, FieldJob)
        return replace(job, **changes)

    def ask(self, job: FieldJob) -> None:
        self.desk.ask(job, self.answers.append)

    def answered(self, count: int) -> list[FieldGrid | Exception]:
        self.go.set()

        def look() -> bool:
            self.desk.deliver()
            return len(self.answers) >= count

        wait_for(look, "the answers")
        return self.answers


@pytest.fixture
def made() -> Iterator[Desk]:
    desk = Desk()
    yield desk
    desk.go.set()
    desk.workers.close()


def test_a_field_is_computed_elsewhere_handed_out_here_and_kept(made: Desk) -> None:
    job = made.job()
    made.ask(job)
    made.desk.deliver()
    assert made.answers == []
    [grid] = made.answered(1)
    assert isinstance(grid, FieldGrid)
    assert made.woken.is_set()
    assert made.engine.lookup(job.request, made.store, None) is grid
    assert made.desk.computing == 0


def test_identical_requests_share_one_computation(made: Desk) -> None:
    for _ in range(3):
        made.ask(made.job())
    assert made.desk.computing == 1
    first, *others = made.answered(3)
    assert all(other is first for other in others)


def test_an_error_goes_to_all_who_asked(made: Desk) -> None:
    broken = made.job(samples=((0.0, 0.0),))
    made.ask(broken)
    made.ask(broken)
    one, two = made.answered(2)
    assert isinstance(one, ValueError)
    assert one is two


def test_so_many_fields_at_once_and_not_one_more(made: Desk) -> None:
    for number in range(MAX_FIELDS):
        made.ask(made.job(number))
    with pytest.raises(FieldRefused, match=f"{MAX_FIELDS} fields are being computed.* ask again"):
        made.ask(made.job(MAX_FIELDS))
    made.ask(made.job(0))  # one of those that are computed anyway
    made.answered(MAX_FIELDS + 1)
    made.ask(made.job(MAX_FIELDS))


def test_so_many_wait_at_once_and_not_one_more(made: Desk) -> None:
    for _ in range(MAX_WAITING):
        made.ask(made.job())
    with pytest.raises(FieldRefused, match=f"{MAX_WAITING} requests wait for fields"):
        made.ask(made.job())


def test_what_is_dropped_with_the_workers_is_handed_to_nobody(made: Desk) -> None:
    made.ask(made.job())
    made.workers.close()
    wait_for(made.woken.is_set, "the desk to be woken")
    made.desk.deliver()
    assert made.answers == []
    assert made.desk.computing == 0
