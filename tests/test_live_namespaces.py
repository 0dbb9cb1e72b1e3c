"""Two greenhouses in one ROS domain, each in its namespace: nothing of one in the other."""

import base64

import httpx

from lupin_twin.core.interfaces import SERVICES
from tests.bridge.routes.test_foxglove import play
from tests.support.foxglove import reader_of
from tests.support.messages import inspection, occupancy_grid, scan
from tests.support.processes import Process, lupin_twin, twin_node, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import listener, tag_ids

FIELD = {"sensor_type": "co2", "resolution": "0.5"}


def below(namespace: str) -> tuple[str, ...]:
    return ("--ros-args", "-r", f"__ns:={namespace}")


def fill(robot: Peer, namespace: str, tag_id: str, co2: float) -> None:
    """What one greenhouse's robot publishes, on its own topics."""
    robot.publish(f"{namespace}/floranova/observations", scan(tag_id, {"co2": co2}, (0, 0)))
    robot.publish(f"{namespace}/floranova/observations", inspection(tag_id, "lupin"))
    robot.publish(f"{namespace}/map", occupancy_grid([[0, 0], [0, 0]]), depth=1)


def answers(process: Process, tag_id: str) -> tuple[list[str], dict[str, object]]:
    """The tags and the field of a bridge, once it has this tag and finds the twin's service."""
    with (
        listener(url_of(process)) as client,
        httpx.Client(base_url=url_of(process), timeout=PATIENCE_S) as http,
    ):
        client.until_tag(tag_id)
        field = wait_for(
            lambda: (
                answer
                if (answer := http.get("/api/field.json", params=FIELD)).status_code == 200
                and answer.json()["sample_count"]
                else None
            ),
            "a field",
        )
        assert field is not None
        wait_for(lambda: http.get("/api/map").status_code == 200, "the map")
        return tag_ids(http.get("/api/state").json()), field.json()


def viewed(process: Process, namespace: str) -> tuple[str, list[int]]:
    """A greenhouse in Foxglove's own client: the tag last observed, and the map."""
    topics = [f"{namespace}/{name}" for name in ("floranova/observations", "map", "twin/state")]
    reported = play(url_of(process), "look", *topics)
    channels = {channel["topic"]: channel for channel in reported["channels"]}
    observation, grid, _state = (
        reader_of(channels[topic])(base64.b64decode(reported["first"][topic]["data"]))
        for topic in topics
    )
    return observation.tag_reading.tag_id or observation.flower.tag_id, list(grid.data)


def test_two_greenhouses_in_one_domain_do_not_mix(domain: int) -> None:
    with (
        twin_node(domain, *below("/gh1")) as first,
        lupin_twin(domain, "serve", *below("/gh2")) as second,
        lupin_twin(domain, "web", *below("/gh1")) as web,
        Peer(domain) as robot,
    ):
        fill(robot, "/gh1", "one", 400.0)
        fill(robot, "/gh2", "two", 900.0)
        fill(robot, "", "root", 100.0)
        ours, field = answers(web, "one")
        assert (ours, field["value_max"]) == (["one"], 400.0)
        theirs, field = answers(second, "two")
        assert (theirs, field["value_max"]) == (["two"], 900.0)
        assert viewed(web, "/gh1") == ("one", [0, 0, 0, 0])
        # The drops of a twin reach its own `web`, from `/diagnostics`.
        robot.publish("/gh1/floranova/observations", scan("nowhere", frame_id="odom"))
        with httpx.Client(base_url=url_of(web), timeout=PATIENCE_S) as http:
            drops = wait_for(lambda: http.get("/readyz").json()["drops"], "what was dropped")
            assert [(drop["reason"], drop["count"]) for drop in drops] == [("frame", 1)]
            metrics = http.get("/metrics").text
        assert '\nlupin_dropped_total{reason="frame"} 1.0' in metrics
        assert '\nlupin_web_dropped_total{reason="frame"} 0.0' in metrics
        # A twin's first line names what it receives and publishes.
        first.wait_for_output("/gh1/lupin_twin in ROS domain")
        for name in ("/gh1/floranova/observations", "/gh1/perception/discovered_tags", "/gh1/map"):
            assert name in first.output
        assert "nodes publish" not in first.output + second.output + web.output
        # The root's names are neither received nor published.
        graph = dict(robot.node.get_topic_names_and_types())
        assert {"/gh1/twin/state", "/gh1/twin/times", "/gh2/twin/state"} <= graph.keys()
        assert "/twin/state" not in graph
        services = dict(robot.node.get_service_names_and_types())
        assert {f"/gh1/{service.name}" for service in SERVICES} <= services.keys()


def test_the_demo_in_a_namespace_includes_its_patrol(domain: int) -> None:
    with (
        # Without the past that it begins with: the data come from the patrol.
        lupin_twin(domain, "demo", "--speed", "20", *below("/gh1"), "-p", "journal:=off") as demo,
        listener(url_of(demo)) as screen,
    ):
        screen.until("state", lambda frame: len(tag_ids(frame["state"])) > 3)
