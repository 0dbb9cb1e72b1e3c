"""Whether an estimate's intervals hold, counted by the hour."""

from lupin_twin.estimate.engine import LEAST_SCANS, Grades, Record, Tally
from tests.bench.bench_estimate_checks import AT_S, ROUNDS, trust
from tests.bench.other_worlds import restless, world_of

HOUR_NS = 3_600 * 1_000_000_000


def test_counts_cover_the_last_day_and_week() -> None:
    grades = Grades(86_400.0)
    assert grades.record(0) == Record(None, Tally(), Tally())
    grades.add(Tally(), 5)
    assert grades.record(5).since_ns is None, "nothing was held to its word"
    grades.add(Tally(10, 9), 5)
    grades.add(Tally(2, 1), 3 * HOUR_NS)
    assert grades.record(3 * HOUR_NS) == Record(5, Tally(12, 10), Tally(12, 10))
    assert grades.record(24 * HOUR_NS) == Record(5, Tally(2, 1), Tally(12, 10))
    assert grades.record(7 * 24 * HOUR_NS) == Record(5, Tally(), Tally(2, 1))
    grades.add(Tally(1, 1), 8 * 24 * HOUR_NS)
    assert grades.record(8 * 24 * HOUR_NS) == Record(5, Tally(1, 1), Tally(1, 1))


def test_a_clock_that_goes_back_drops_the_future() -> None:
    grades = Grades(86_400.0)
    grades.add(Tally(5, 5), 10 * HOUR_NS)
    grades.add(Tally(1, 0), 2 * HOUR_NS)
    assert grades.record(2 * HOUR_NS) == Record(2 * HOUR_NS, Tally(1, 0), Tally(1, 0))
    assert grades.record(10 * HOUR_NS).day == Tally(1, 0)


def test_a_model_is_trusted_by_its_day_and_week_and_few_scans_change_nothing() -> None:
    good, bad, few = Tally(100, 80), Tally(100, 79), Tally(LEAST_SCANS - 1, 0)
    assert Record(1, good, good).is_trusted is True
    assert Record(1, bad, good).is_trusted is False
    assert Record(1, good, bad).is_trusted is False
    assert Record(1, few, good).is_trusted is True
    assert Record(1, few, few).is_trusted is None
    assert Record(None, Tally(), Tally()).is_trusted is None
    assert Record(1, Tally(LEAST_SCANS, LEAST_SCANS), good).is_trusted is True


def test_an_estimate_with_poor_coverage_is_distrusted_and_one_with_good_coverage_trusted() -> None:
    calm = world_of("wall", 0)
    read = calm.read(AT_S + (ROUNDS + 1) * calm.round_s, 0)
    is_trusted, covers = trust(calm, read)
    assert is_trusted is True
    assert covers > 0.8
    # Parameters from a calm day are wrong once its air swings.
    windy = restless(calm, AT_S, 0)
    is_trusted, covers = trust(windy, windy.read(read.time_s[-1], 0))
    assert is_trusted is False
    assert covers < 0.7
