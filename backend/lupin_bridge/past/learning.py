"""What was recent before this process heard of it: the log is asked."""

from __future__ import annotations

import asyncio
import logging
from typing import Final

from lupin_bridge.judge.judging import Judge
from lupin_bridge.twin.looking import Itself
from lupin_bridge.twin.source import TwinSource, TwinUnavailableError
from lupin_twin.past import NotRemembered, PastRefused
from lupin_twin.past_writes import PastWrite, RecentRequest
from lupin_twin.state import Snapshot

log = logging.getLogger(__name__)

# How long a question of the past rests that could not be answered.
ASK_AGAIN_S: Final = 2.0
# What is recent of a tag, looked up and judged by, takes so long, about.
RECENT_S_PER_TAG: Final = 2e-4


async def learn_recent(source: TwinSource, judge: Judge, first: Snapshot) -> None:
    """Tell the judge of what was recent at the first state: who starts must not call all old."""
    try:
        judge.learn(await _patiently(source, first))
    except (NotRemembered, PastRefused, TwinUnavailableError) as error:
        log.info("what was recent before is not known: %s", error)
    except Exception:  # nobody waits for this, and nothing else needs what it learns
        log.exception("what was recent before is not known")


async def _patiently(source: TwinSource, first: Snapshot) -> tuple[PastWrite, ...]:
    """What was recent, however long nobody can tell it just now."""
    cost_s = len(first.tags) * RECENT_S_PER_TAG
    while True:
        try:
            return await source.ask(Itself(RecentRequest(first.stamp_ns)), cost_s)
        except TwinUnavailableError:
            pass
        except NotRemembered as error:
            if error.is_lasting:
                raise
        await asyncio.sleep(ASK_AGAIN_S)
