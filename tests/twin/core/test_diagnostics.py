from dataclasses import replace
from typing import Any

import pytest

from lupin_twin.core.diagnostics import (
    ERROR,
    MAX_SHOWN,
    OK,
    STALE,
    UNKNOWN_JOURNAL,
    WARN,
    Condition,
    Finding,
    Health,
    JournalState,
    Origin,
    SelfReport,
    findings,
    self_report,
)
from lupin_twin.core.drops import Counts, Recent
from lupin_twin.core.state import ClockState

WELL = Health(
    clock="running",
    counts=Counts(),
    inputs={"/floranova/observations": 1},
    observed_ago_s=2.0,
    late={},
    twins=1,
    state_topic="/twin/state",
    fields_computing=0,
    fields_computed=3,
    slowest_field_s=0.25,
)
FRAME = Recent("frame", "its frame is 'odom'", 12)


def found(name: str, **changes: Any) -> Finding:
    [finding] = [each for each in findings(replace(WELL, **changes)) if each.name == name]
    return finding


def test_a_healthy_twin_is_ok_in_every_check() -> None:
    levels = {finding.name: finding.level for finding in findings(WELL)}
    names = "clock origin inputs drops stamps fields journal twins"
    assert levels == dict.fromkeys(names.split(), OK)


@pytest.mark.parametrize(
    ("name", "changes", "level", "words"),
    [
        ("clock", {"clock": "paused"}, WARN, "paused"),
        ("clock", {"clock": "stopped"}, ERROR, "stopped"),
        ("clock", {"clock": "none"}, ERROR, "no ROS time"),
        ("inputs", {"observed_ago_s": None}, STALE, "no observation"),
        ("inputs", {"inputs": {"/map": 0}}, WARN, "nothing publishes /map"),
        ("inputs", {"observed_ago_s": None, "input_problems": ("use UDP",)}, WARN, "use UDP"),
        ("drops", {"counts": Counts({"frame": 40}, 0, (FRAME,))}, WARN, "12 recently"),
        ("drops", {"counts": Counts({"frame": 40})}, OK, "nothing recently"),
        ("drops", {"counts": Counts(callback_errors=1)}, WARN, "nothing recently"),
        ("stamps", {"late": {"robot": 9}}, WARN, "behind their own earlier ones from robot"),
        ("journal", {"journal": Condition(JournalState.FAILING, "no room")}, ERROR, "no room"),
        ("twins", {"twins": 2}, ERROR, "2 twins"),
    ],
)
def test_each_fault_has_its_level(
    name: str, changes: dict[str, Any], level: int, words: str
) -> None:
    finding = found(name, **changes)
    assert finding.level == level
    assert words in finding.message


def test_the_numbers_are_there() -> None:
    counts = Counts({"frame": 40, "lost": 5}, 0, (FRAME,))
    values = {
        "frame": "40",
        "lost": "5",
        "recently: frame": "12",
        "last: frame": "its frame is 'odom'",
        "callback errors": "0",
    }
    assert found("drops", counts=counts).values == values
    assert found("fields").values == {"computed": "3", "slowest, s": "0.250"}
    assert found("inputs").values["last observation, s ago"] == "2.0"


@pytest.mark.parametrize("clock", ["running", "paused", "stopped", "none"])
def test_a_reported_finding_is_parsed_back(clock: ClockState) -> None:
    recent = (FRAME, Recent("lost", "lost messages", 2), Recent("late_stamp", "late", 1))
    counts = Counts({"frame": 40, "lost": 5, "late_stamp": 1}, 3, recent)
    assert self_report(findings(replace(WELL, clock=clock, counts=counts))) == SelfReport(
        clock, counts, UNKNOWN_JOURNAL, "robot"
    )


@pytest.mark.parametrize("origin", ["unknown", "robot", "simulated", "recorded", "sim_time"])
def test_the_source_of_observations_is_parsed_back(origin: Origin) -> None:
    assert self_report(findings(replace(WELL, origin=origin))).origin == origin
    assert self_report([found("origin", origin=origin)]).origin == origin
    assert self_report([Finding("origin", OK, "", {"origin": "elsewhere"})]).origin == "unknown"


def test_the_journals_report_is_parsed_back() -> None:
    reported = Condition(
        JournalState.FAILING,
        "the disk is full",
        "/j.sqlite",
        written=7,
        waiting=2,
        lost=3,
        quarantined="/j.sqlite.damaged",
        simulated_ns=(1_763_440_800_000_000_001, 1_763_700_000_000_000_000),
        complete_ns=1_763_700_000_000_000_002,
        kept_ns=((0, 5), (7, 2**63 - 1)),
        journal_id="0123456789abcdef",
    )
    none: dict[str, Any] = {"simulated_ns": None, "complete_ns": None, "kept_ns": ()}
    for journal in (reported, replace(reported, **none)):
        assert self_report(findings(replace(WELL, journal=journal))).journal == journal
    for values in ({}, {"state": "constructor"}):
        assert self_report([Finding("journal", OK, "", values)]).journal == UNKNOWN_JOURNAL
    for stretch in ("1", "1 x", "x 1", " ", "1 " + 20 * "9"):
        values = {"state": "recording", "simulated": stretch}
        assert self_report([Finding("journal", OK, "", values)]).journal.simulated_ns is None
        values = {"state": "recording", "complete to": stretch, "kept": stretch}
        read = self_report([Finding("journal", OK, "", values)]).journal
        assert (read.complete_ns, read.kept_ns) == (1 if stretch == "1" else None, ())


@pytest.mark.parametrize("own", ["../accounts", "/etc/passwd", "a/b", "..", "j\u00fc", "x" * 600])
def test_a_journal_name_that_could_lead_to_another_file_is_dropped(own: str) -> None:
    values = {"state": "recording", "id": own}
    assert self_report([Finding("journal", OK, "", values)]).journal.journal_id == ""


def test_a_missing_report_is_not_read_as_no_drops() -> None:
    assert self_report(()) == SelfReport(None, None)
    assert self_report([Finding("clock", OK, "", {"state": "well"})]) == SelfReport(None, None)


@pytest.mark.parametrize("text", ["", "-1", "1.5", "many", "²", "9" * 16])
def test_an_invalid_number_counts_nothing(text: str) -> None:
    values = {"frame": text, "recently: frame": text, "callback errors": text, "spoons": "7"}
    assert self_report([Finding("drops", OK, "", values)]).counts == Counts()


def test_a_long_text_is_cut_at_the_limit() -> None:
    for length in (MAX_SHOWN, MAX_SHOWN + 1):
        word = "x" * length
        wording = found("drops", counts=Counts({"frame": 1}, 0, (Recent("frame", word, 1),)))
        shown = wording.values["last: frame"]
        assert (len(shown), shown == word) == (MAX_SHOWN, length == MAX_SHOWN)
        [source] = found("stamps", late={word: 1}).values
        assert source == shown
