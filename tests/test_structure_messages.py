"""The wire format: names, types and order are shared with the robot's own packages, for good."""

from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "ros_node" / "lupin_msgs"

# Written from the contract, not from the files. `---` separates request and response.
WIRE_FORMAT = {
    "msg/SensorReading.msg": "string name · float64 value",
    "msg/TagReading.msg": (
        "string tag_id · builtin_interfaces/Time stamp · float64 sim_time_of_day_seconds · "
        "SensorReading[] readings"
    ),
    "msg/FlowerPoint.msg": (
        "geometry_msgs/Point position · float32 height_m · string species · float32 confidence · "
        "bool anomaly"
    ),
    "msg/FlowerObservation.msg": (
        "string tag_id · geometry_msgs/PoseStamped pose · string species · float32 confidence · "
        "bool anomaly · uint16 flower_count · uint16 bug_count · FlowerPoint[] flowers · "
        "geometry_msgs/Polygon box_footprint"
    ),
    "msg/AnomalyReport.msg": (
        "geometry_msgs/PoseStamped pose · string description · uint8 severity"
    ),
    "msg/Observation.msg": (
        "std_msgs/Header header · string mission_id · string source · "
        "uint8 KIND_TAG_READING=0 · uint8 KIND_FLOWER=1 · uint8 KIND_ANOMALY=2 · uint8 kind · "
        "uint8 STATUS_OK=0 · uint8 STATUS_UNREACHABLE=1 · uint8 STATUS_SCAN_FAILED=2 · "
        "uint8 STATUS_SKIPPED=3 · uint8 status · string status_detail · "
        "TagReading tag_reading · FlowerObservation flower · AnomalyReport anomaly · "
        "geometry_msgs/Pose tag_pose_in_map"
    ),
    "msg/DiscoveredTag.msg": (
        "string tag_id · geometry_msgs/Pose pose_in_map · string species · "
        "float32 species_confidence · bool anomaly · uint32 sightings"
    ),
    "msg/DiscoveredTags.msg": "std_msgs/Header header · DiscoveredTag[] tags",
    "msg/TwinTagState.msg": (
        "string tag_id · geometry_msgs/Pose pose · SensorReading[] readings · "
        "builtin_interfaces/Time last_observed · float32 stale_seconds · string species · "
        "float32 species_confidence · bool anomaly · uint16 flower_count · uint16 bug_count · "
        "FlowerPoint[] flowers · geometry_msgs/Polygon box_footprint"
    ),
    "msg/TwinState.msg": "std_msgs/Header header · TwinTagState[] tags",
    "msg/TagTimes.msg": (
        "string tag_id · string[] sensors · builtin_interfaces/Time[] observed_at · "
        "builtin_interfaces/Time looked_at · builtin_interfaces/Time last_try · "
        "uint8 last_try_status · string last_try_detail"
    ),
    "msg/TwinTimes.msg": "std_msgs/Header header · TagTimes[] tags",
    "srv/GetEstimate.srv": (
        "string sensor_type · float32 resolution · float32 bbox_min_x · float32 bbox_min_y · "
        "float32 bbox_max_x · float32 bbox_max_y · builtin_interfaces/Time at · --- · bool ok · "
        "string error_message · float32[] mean · float32[] sd · uint32 width · uint32 height · "
        "float32 origin_x · float32 origin_y · float32 resolution_used · float32 sd_known · "
        "uint32 sample_count · uint32 reading_count"
    ),
    "srv/GetEstimateReport.srv": (
        "string sensor_type · uint32 max_places · --- · bool ok · string error_message · "
        "builtin_interfaces/Time at · builtin_interfaces/Time fitted_at · string fit_problem · "
        "builtin_interfaces/Time graded_since · uint32 day_scans · uint32 day_inside · "
        "uint32 week_scans · uint32 week_inside · string[] tag_ids · float64[] measured · "
        "builtin_interfaces/Time[] observed_at · float64[] expected · float64[] expected_sd · "
        "float64[] z · float64[] offset · bool[] left_out · "
        "builtin_interfaces/Time[] changed_since · float64[] place_x · float64[] place_y · "
        "float64[] error_ratio"
    ),
    "srv/GetField.srv": (
        "string sensor_type · float32 resolution · float32 bbox_min_x · float32 bbox_min_y · "
        "float32 bbox_max_x · float32 bbox_max_y · --- · bool ok · string error_message · "
        "float32[] values · uint32 width · uint32 height · float32 origin_x · float32 origin_y · "
        "float32 resolution_used · float32 value_min · float32 value_max · uint32 sample_count"
    ),
    "srv/GetStateAt.srv": (
        "builtin_interfaces/Time at · --- · bool ok · string error_message · "
        "TwinState state · TwinTimes times"
    ),
    "srv/GetHistory.srv": (
        "string tag_id · string sensor_type · builtin_interfaces/Time start · "
        "builtin_interfaces/Time end · uint32 max_points · --- · bool ok · string error_message · "
        "bool is_bucketed · builtin_interfaces/Time[] stamps · uint32[] counts · "
        "float64[] means · float64[] minima · float64[] maxima"
    ),
    "srv/GetWrites.srv": (
        "uint64 after · float64 reach_s · uint64 reach_count · uint32 max_count · "
        "bool as_rows · --- · bool ok · string error_message · string journal · uint64 last · "
        "bool is_all · "
        "uint32[] span_runs · int64[] span_starts_ns · int64[] span_ends_ns · string[] texts · "
        "uint64[] numbers · uint32[] runs · uint32[] tags · int64[] stamps_ns · uint8[] kinds · "
        "uint8[] statuses · uint32[] reading_counts · bool[] has_seen · uint32[] species · "
        "bool[] anomalies · uint16[] bug_counts · uint32[] sensors · float64[] values · "
        "string[] rows"
    ),
}


_KINDS = (".msg", ".srv", ".action")


def lines_of(name: str) -> list[str]:
    return (PACKAGE / name).read_text(encoding="utf-8").splitlines()


def test_exactly_these_interfaces_exist() -> None:
    """The package's own tests check that all of them are built."""
    files = {p.relative_to(PACKAGE).as_posix() for p in PACKAGE.glob("*/*") if p.suffix in _KINDS}
    assert files == set(WIRE_FORMAT)


@pytest.mark.parametrize("name", WIRE_FORMAT)
def test_names_types_order_and_constants_are_those_of_the_contract(name: str) -> None:
    declared = [" ".join(line.partition("#")[0].split()) for line in lines_of(name)]
    assert [line for line in declared if line] == WIRE_FORMAT[name].split(" · ")


@pytest.mark.parametrize("name", WIRE_FORMAT)
def test_every_field_and_every_interface_has_a_comment(name: str) -> None:
    lines = lines_of(name)
    assert lines[0].startswith("# ")
    bare = [
        line
        for before, line in zip(["", *lines], lines, strict=False)
        if line
        and "=" not in line.partition("#")[0]
        and line != "---"
        and "#" not in line
        and not before.startswith("#")
    ]
    assert bare == []
