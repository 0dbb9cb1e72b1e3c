"""What was recent before this process started, from the log."""

from __future__ import annotations

import asyncio
import logging
from typing import Final

from lupin_bridge.feed.query import Itself
from lupin_bridge.feed.source import TwinSource, TwinUnavailableError
from lupin_bridge.judge.judging import Judge
from lupin_twin.core.past import NotRemembered, PastRefused
from lupin_twin.core.state import Snapshot
from lupin_twin.core.writes import PastWrite, RecentRequest

log = logging.getLogger(__name__)

# Between two attempts.
RETRY_S: Final = 2.0
# What is recent of a tag, looked up and judged by, takes so long, about.
RECENT_S_PER_TAG: Final = 2e-4


async def learn_recent(source: TwinSource, judge: Judge, first: Snapshot) -> None:
    """Give the judge what was recent at the first state: after a start not everything is old."""
    try:
        judge.learn(await _patiently(source, first))
    except (NotRemembered, PastRefused, TwinUnavailableError) as error:
        log.info("what was recent before is not known: %s", error)
    except Exception:  # nobody awaits this, and nothing else needs it
        log.exception("what was recent before is not known")


async def _patiently(source: TwinSource, first: Snapshot) -> tuple[PastWrite, ...]:
    """What was recent; repeated while the log cannot be read."""
    cost_s = len(first.tags) * RECENT_S_PER_TAG
    while True:
        try:
            return await source.ask(Itself(RecentRequest(first.stamp_ns)), cost_s)
        except TwinUnavailableError:
            pass
        except NotRemembered as error:
            if error.is_lasting:
                raise
        await asyncio.sleep(RETRY_S)
