"""How much a bridge does for its clients. No setting: nobody who runs one knows better."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Times in seconds.

    `client_timeout_s`: a client that asks, or takes, nothing for so long is cut off.
    `answer_timeout_s`: a computed answer that takes longer ends in 504, and its work with it.
    `answers_per_s` may be computed for one client, and two seconds' worth at once: a page that is
    dragged through the past asks for ten moments a second, each for a state and a field or two;
    and behind one address there may be two such pages. `concurrency` of them may be under way for
    one client (a browser asks for six at once), `total_concurrency` for all of them together, of
    which large ones take three quarters. `frames_per_s` is what the state's listeners get at most,
    on average. Alarms are worked out from `alarm_days` before the start on.
    """

    client_timeout_s: float = 30.0
    answer_timeout_s: float = 10.0
    answers_per_s: float = 50.0
    concurrency: int = 8
    total_concurrency: int = 32
    frames_per_s: float = 10.0
    alarm_days: float = 7.0
