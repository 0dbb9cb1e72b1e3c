"""Smoke test of the installed twin package: its core, and the imports of its node."""

from __future__ import annotations

from lupin_twin.core.parameters import TwinParameters
from lupin_twin.field.idw import compute_idw_field
from lupin_twin.ros.node import NODE_NAME


def test_a_field_halfway_between_two_tags() -> None:
    grid = compute_idw_field(
        [(0.0, 0.0, 10.0), (2.0, 0.0, 20.0)],
        bbox_min_x=0.5,
        bbox_min_y=-0.5,
        bbox_max_x=1.5,
        bbox_max_y=0.5,
        resolution=1.0,
        falloff_radius_m=1.5,
        max_distance_m=1.5,
        power=2.0,
    )
    assert grid.values.tolist() == [15.0]


def test_the_node_can_be_imported_and_has_its_contracts_names() -> None:
    assert (NODE_NAME, TwinParameters().state_topic) == ("lupin_twin", "twin/state")
