"""Which tags are said to have changed: wrongly, in days like any other; rightly, and how soon.

On houses and seeds that nothing was chosen on. A house is screened as the node does it: a tag's
sensor at each of its scans, with what was known the last time, by a model that is fitted anew every
six hours. A sensor that has changed reads so much more from one scan on.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict

import numpy as np

from lupin_twin.estimate import Readings, fit, screen
from tests.bench.worlds import HOUR_S, PASS_S, World, others, own

# How far off a sensor is that has changed, in its unit.
OFFSETS = {
    "temperature": 3.0,
    "humidity": 5.0,
    "co2": 100.0,
    "light": 100.0,
    "soil_moisture": 10.0,
}
# The onset of a change, and the scans after it at which one asks whether it was found.
ONSET_S = 30 * HOUR_S
ASKED_AFTER = (1, 2, 4)
# A day that is followed from here on.
FROM_S = 24 * HOUR_S
FIT_S = 6 * HOUR_S


def false_alarms(world: World, of_house: int) -> tuple[int, int]:
    """Tags that were said to have changed within a day, though none had; and readings scored."""
    everything = world.scans(of_house, FROM_S + 24 * HOUR_S)
    scored = np.flatnonzero(everything.time_s > FROM_S)
    model, fitted_s, known, alarms = None, -np.inf, dict[int, float](), 0
    for index in scored:
        at_s = float(everything.time_s[index])
        heard = everything.take(everything.time_s <= at_s).recent(at_s)
        if model is None or at_s - fitted_s >= FIT_S:
            model, fitted_s = fit(heard), at_s
        now = screen(model, heard, known).changed
        alarms += len(set(now) - set(known))
        known = now
    return alarms, len(scored)


def found_after(world: World, of_house: int) -> dict[int, bool]:
    """Whether a tag that has changed was found so many scans later, and no other was."""
    clean = world.scans(of_house, ONSET_S + 6 * PASS_S)
    tags = np.unique(clean.tag)
    tag = int(tags[world.seed % len(tags)])
    value = clean.value.copy()
    is_off = (clean.tag == tag) & (clean.time_s >= ONSET_S)
    value[is_off] += OFFSETS[world.sensor]
    times_s = np.sort(clean.time_s[is_off])
    before = clean.take(clean.time_s < ONSET_S).recent(ONSET_S)
    model, known, result = fit(before), dict[int, float](), {}
    for scans in range(1, max(ASKED_AFTER) + 1):
        at_s = float(times_s[scans - 1])
        heard = Readings(clean.time_s, clean.tag, value, clean.xy)
        known = screen(model, heard.take(clean.time_s <= at_s).recent(at_s), known).changed
        if scans in ASKED_AFTER:
            result[scans] = list(known) == [tag]
    return result


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1000, help="the first seed")
    parser.add_argument("--days", type=int, default=2, help="houses followed for a day, each sort")
    parser.add_argument("--changes", type=int, default=8, help="houses with a change, each sort")
    options = parser.parse_args([] if arguments is None else arguments)
    for name, make in (("own", own), ("houses", others)):
        alarms: dict[int, int] = defaultdict(int)
        readings = 0
        for world, of_house in make(range(options.first, options.first + options.days)):
            found, scored = false_alarms(world, of_house)
            alarms[world.seed] += found
            readings += scored
            print(".", end="", file=sys.stderr, flush=True)
        each = [alarms[seed] for seed in range(options.first, options.first + options.days)]
        mean = np.mean(each)
        print(f"\nfalse alarms, {name}: {mean:.1f} a house and day, {readings} readings, {each}")
    results: dict[str, list[dict[int, bool]]] = defaultdict(list)
    for make in (own, others):
        for world, of_house in make(range(options.first, options.first + options.changes)):
            results[world.sensor].append(found_after(world, of_house))
            print(".", end="", file=sys.stderr, flush=True)
    print(f"\n{'found, and nothing else':<28}" + "".join(f"{n:>4} scans" for n in ASKED_AFTER))
    for sensor, offset in OFFSETS.items():
        shares = [np.mean([one[scans] for one in results[sensor]]) for scans in ASKED_AFTER]
        label = f"{sensor} +{offset:g}"
        print(f"{label:<28}" + "".join(f"{share:>10.2f}" for share in shares))


if __name__ == "__main__":
    main(sys.argv[1:])
