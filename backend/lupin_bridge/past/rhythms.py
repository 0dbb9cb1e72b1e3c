"""How often each tag was scanned before this process heard of it: the past is asked."""

from __future__ import annotations

import asyncio
import logging
from typing import Final

from lupin_bridge.judge.judging import Judge
from lupin_bridge.twin.source import TwinSource, TwinUnavailableError
from lupin_twin.past import MAX_POINTS, Event, NotRemembered, PastRefused, SeriesPast, SeriesRequest
from lupin_twin.state import NANOSECONDS_PER_SECOND, Snapshot

log = logging.getLogger(__name__)

# How long a question of the past rests that could not be answered.
ASK_AGAIN_S: Final = 2.0
# How far back the scans are asked for that a tag's rhythm is learnt from.
REACH_NS: Final = 3 * 24 * 3600 * NANOSECONDS_PER_SECOND


async def learn_rhythms(source: TwinSource, judge: Judge, first: Snapshot) -> None:
    """Tell the judge of the scans before the first state: who starts must not call all old."""
    start_ns = max(1, first.stamp_ns - REACH_NS)
    try:
        for tag in first.tags:
            asked = SeriesRequest(tag.tag_id, Event.SCANS, start_ns, 0, MAX_POINTS)
            past = await _patiently(source, asked)
            if not past.is_bucketed:
                judge.learn(tag.tag_id, past.stamps_ns)
    except (NotRemembered, PastRefused, TwinUnavailableError) as error:
        log.info("how often tags were scanned before is not known: %s", error)
    except Exception:  # nobody waits for this, and nothing else needs what it learns
        log.exception("how often tags were scanned before is not known")


async def _patiently(source: TwinSource, asked: SeriesRequest) -> SeriesPast:
    """The series, however long nobody can tell it just now."""
    while True:
        try:
            return await source.series(asked)
        except TwinUnavailableError:
            pass
        except NotRemembered as error:
            if error.is_lasting:
                raise
        await asyncio.sleep(ASK_AGAIN_S)
