"""Whom to turn out when the house is full: who has waited longest and asked for nothing. Pure.

An open connection costs a file, and there are only so many. Who holds one without having asked for
anything yet, or without taking what it asked for, goes before anybody is kept out. And first of all
goes who comes from the address with the most connections, so that one address, however many it
opens, crowds out none but itself.
"""

from __future__ import annotations

import heapq
from collections import Counter, defaultdict
from collections.abc import Iterable
from typing import Protocol


class Guest(Protocol):
    """One connection; `HttpConnection` is one, and a handshake of TLS."""

    @property
    def address(self) -> str:
        """The client that it comes from (`rate_limit.client_key`)."""

    @property
    def waiting_since_s(self) -> float | None:
        """Since when it has done nothing but wait, s; None: it is being served."""

    def abort(self) -> None:
        """End it now."""


def whom_to_turn_out(guests: Iterable[Guest], number: int) -> list[Guest]:
    """At most `number` guests that wait, of the largest parties, the longest waiting first.

    After each one its party is one smaller; of two of the same size the one with the longest
    waiting guest counts as larger.
    """
    sizes: Counter[str] = Counter()
    waiting: defaultdict[str, list[tuple[float, int, Guest]]] = defaultdict(list)
    for order, guest in enumerate(guests):
        sizes[guest.address] += 1
        since_s = guest.waiting_since_s
        if since_s is not None:
            waiting[guest.address].append((since_s, order, guest))
    parties: list[tuple[int, float, int, str]] = []
    for address, party in waiting.items():
        party.sort(key=lambda entry: entry[:2], reverse=True)
        parties.append((-sizes[address], *party[-1][:2], address))
    heapq.heapify(parties)
    chosen: list[Guest] = []
    while parties and len(chosen) < number:
        size, _, _, address = parties[0]
        party = waiting[address]
        chosen.append(party.pop()[2])
        if party:
            heapq.heapreplace(parties, (size + 1, *party[-1][:2], address))
        else:
            heapq.heappop(parties)
    return chosen
