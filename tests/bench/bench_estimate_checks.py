"""The estimate's own checks: sensors that have changed, and whether it can be trusted.

On the greenhouses of `other_worlds`, at a moment of the second day. A sensor that has changed reads
3 more from one scan on; all tags but that one are false alarms, and all in greenhouses where none
has. An estimate is trusted by the scans of ten rounds, each predicted from earlier ones of all tags
but those beside it. Its real accuracy is the mean coverage of all cells in these rounds. In half of
the greenhouses the air becomes restless as they begin: parameters of a calm day are wrong then.
"""

from collections import Counter

import numpy as np

from lupin_twin.estimate.engine import thinned
from lupin_twin.estimate.grading import Record, Tally, predicted
from lupin_twin.estimate.kernel import Readings
from lupin_twin.estimate.model import fit
from lupin_twin.estimate.posterior import Posterior
from tests.bench.bench_estimate import INTERVAL_SDS, case_of
from tests.bench.other_worlds import (
    DAY_S,
    HOUR_S,
    JUDGING,
    SORTS,
    World,
    restless,
    world_of,
)

OFFSET = 3.0
AFTER = (1, 2, 4, 8)
AT_S = 34 * HOUR_S
# In these, sensors do change.
CHANGING = ("drift", "stuck sensors")
ROUNDS = 10


def posterior_at(all_read: Readings, at_s: float) -> Posterior:
    received = thinned(all_read.take(all_read.time_s <= at_s), at_s, DAY_S)
    return fit(received).posterior(received, at_s)


def changed(all_read: Readings, at_s: float) -> list[int]:
    found = posterior_at(all_read, at_s).changes()
    return [tag for tag, one in enumerate(found) if one is not None and one.since_s is not None]


def found_after(all_read: Readings, tag: int) -> tuple[dict[int, bool], int]:
    """Whether it was found after that many scans; false alarms at the last of these."""
    own = np.flatnonzero((all_read.tag == tag) & (all_read.time_s > AT_S))
    value = all_read.value.copy()
    value[own] += OFFSET
    off = Readings(all_read.time_s, all_read.tag, value, all_read.xy)
    found, others = {}, 0
    for count in AFTER:
        message = changed(off, float(all_read.time_s[own[count - 1]]))
        found[count], others = tag in message, len(set(message) - {tag})
    return found, others


def trust(world: World, all_read: Readings) -> tuple[bool | None, float]:
    """The verdict of ten rounds by a model of the day before; the mean coverage of all cells."""
    end_s = AT_S + ROUNDS * world.round_s
    received = thinned(all_read.take(all_read.time_s <= AT_S), AT_S, DAY_S)
    since = all_read.time_s > AT_S - DAY_S
    graded = predicted(fit(received), all_read.take(since & (all_read.time_s <= end_s)), AT_S)
    inside = [off <= INTERVAL_SDS * sd for _, off, sd in graded]
    covers = []
    places = case_of(world, "after one round", 0).places
    for number in range(1, ROUNDS + 1):
        at_s = AT_S + number * world.round_s
        mean, sd = posterior_at(all_read, at_s).points(places)
        truth = world.truth(places, np.full(len(places), at_s))
        covers.append((np.abs(truth - mean) <= INTERVAL_SDS * sd).mean())
    tally = Tally(len(inside), sum(inside))
    return Record(0, tally, tally).is_trusted, float(np.mean(covers))


def main() -> None:
    found: Counter[int] = Counter()
    greenhouses = alarms = tags = 0
    message: Counter[tuple[str, bool | None, bool]] = Counter()
    for sort in SORTS:
        for seed in JUDGING:
            world = world_of(sort, seed)
            all_read = world.read(AT_S + (max(AFTER) + 2) * world.round_s + 4 * HOUR_S, seed)
            for name, one in (("as usual", world), ("restless", restless(world, AT_S, seed))):
                is_trusted, covers = trust(one, one.read(all_read.time_s[-1], seed))
                message[name, is_trusted, covers < 0.7] += 1
            if sort in CHANGING:
                continue
            greenhouses += 1
            tags += len(world.xy)
            alarms += len(changed(all_read, AT_S))
            for count, is_found in found_after(all_read, seed % len(world.xy))[0].items():
                found[count] += is_found
    print(
        f"said to have changed where none has: {alarms} of {tags} tags, {greenhouses} greenhouses"
    )
    for count in AFTER:
        print(f"+{OFFSET:g} found after {count} scans: {found[count] / greenhouses:.2f}")
    for name, trusted, is_narrow in sorted(message, key=str):
        what = "under 0.7" if is_narrow else "0.7 or more"
        count = message[name, trusted, is_narrow]
        print(f"{name}: is_trusted {trusted}, coverage {what}: {count}")
