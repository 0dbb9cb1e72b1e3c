"""Every topic and service of a twin: name, type, QoS and meaning, in one table. Pure.

The nodes publish, subscribe and serve by it; the reference and the SROS 2 policy are generated from
it. Names are relative to the node's namespace, but for those that ROS itself gives to everybody.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from lupin_twin.core.parameters import TwinParameters

# Requests that may wait for a service, of all clients together, and answers that may wait in a
# client, where those to all other clients come along: of more, DDS loses the oldest without a word.
# ROS's default is 10.
SERVICE_DEPTH: Final = 50


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic and its QoS; `type_name` such as `lupin_msgs/msg/TwinState`.

    `is_latched`: TRANSIENT_LOCAL, so that a late subscriber gets the last `depth` messages.
    `parameter` names the twin's parameter that renames the topic; empty: only remapping does.
    """

    name: str
    type_name: str
    meaning: str
    depth: int = 1
    is_latched: bool = True
    is_reliable: bool = True
    parameter: str = ""


@dataclass(frozen=True, slots=True)
class Service:
    """A service, reliable and volatile; `type_name` such as `lupin_msgs/srv/GetField`."""

    name: str
    type_name: str
    meaning: str
    parameter: str = ""


_DEFAULTS: Final = TwinParameters()
# Below it each layer's name is made of its sensor's, see `layers.topic_of`.
LAYERS_BELOW: Final = "twin/field/"

OBSERVATIONS: Final = Topic(
    _DEFAULTS.observations_topic,
    "lupin_msgs/msg/Observation",
    "one scan, one inspection of flowers, or one failed attempt",
    depth=50,
    parameter="observations_topic",
)
DISCOVERED_TAGS: Final = Topic(
    _DEFAULTS.discovered_tags_topic,
    "lupin_msgs/msg/DiscoveredTags",
    "tags that perception has seen, and their places",
    depth=50,
    parameter="discovered_tags_topic",
)
MAP: Final = Topic(
    _DEFAULTS.map_topic,
    "nav_msgs/msg/OccupancyGrid",
    "the floor as SLAM knows it",
    parameter="map_topic",
)
CLOCK: Final = Topic(
    "/clock",
    "rosgraph_msgs/msg/Clock",
    "simulated time; only with `use_sim_time`",
    is_latched=False,
    is_reliable=False,
)
SUBSCRIBED: Final = (OBSERVATIONS, DISCOVERED_TAGS, MAP, CLOCK)

STATE: Final = Topic(
    _DEFAULTS.state_topic,
    "lupin_msgs/msg/TwinState",
    "every tag as it is now, `state_publish_rate_hz` times a second",
    parameter="state_topic",
)
TIMES: Final = Topic(
    "twin/times",
    "lupin_msgs/msg/TwinTimes",
    "when each value of the state was observed; published right behind it, with the same stamp",
)
LAYERS: Final = Topic(
    f"{LAYERS_BELOW}<sensor>",
    "sensor_msgs/msg/PointCloud2",
    "the field of a sensor as points, for each sensor of the parameter `layers`; published on "
    "change, while somebody subscribes",
)
TAGS: Final = Topic(
    "twin/tags",
    "visualization_msgs/msg/MarkerArray",
    "tags and their names; published on change, while somebody subscribes",
)
PLANTERS: Final = Topic(
    "twin/planters",
    "visualization_msgs/msg/MarkerArray",
    "outlines of planters; published on change, while somebody subscribes",
)
DIAGNOSTICS: Final = Topic(
    "/diagnostics",
    "diagnostic_msgs/msg/DiagnosticArray",
    "what the twin reports of itself, once a second: clock, inputs, drops, layers, journal",
    depth=10,
    is_latched=False,
)
PUBLISHED: Final = (STATE, TIMES, LAYERS, TAGS, PLANTERS, DIAGNOSTICS)

GET_FIELD: Final = Service(
    _DEFAULTS.field_service_name,
    "lupin_msgs/srv/GetField",
    "one sensor's field over a box",
    parameter="field_service_name",
)
GET_ESTIMATE: Final = Service(
    "twin/get_estimate", "lupin_msgs/srv/GetEstimate", "one sensor's estimate and its error"
)
GET_ESTIMATE_REPORT: Final = Service(
    "twin/get_estimate_report",
    "lupin_msgs/srv/GetEstimateReport",
    "how good the estimates are, which sensors have changed, where another tag helps",
)
GET_STATE_AT: Final = Service(
    "twin/get_state_at", "lupin_msgs/srv/GetStateAt", "state and times as of a past moment"
)
GET_HISTORY: Final = Service(
    "twin/get_history", "lupin_msgs/srv/GetHistory", "one sensor's past, or events"
)
GET_WRITES: Final = Service(
    "twin/get_writes",
    "lupin_msgs/srv/GetWrites",
    "all observations in the order in which they were received, for a follower",
)
SERVICES: Final = (
    GET_FIELD,
    GET_ESTIMATE,
    GET_ESTIMATE_REPORT,
    GET_STATE_AT,
    GET_HISTORY,
    GET_WRITES,
)
# Those that rclpy gives to each node, below its own name.
OF_EVERY_NODE: Final = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "get_type_description",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
