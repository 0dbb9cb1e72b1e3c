"""How soon a first model serves: s from a sensor's tenth scan on, of five sensors at once.

Of a twin that hears its first ten scans, and of a demo that starts with a day behind it: there
they are all known when the bridge first answers.
"""

from __future__ import annotations

import time

from lupin_msgs.srv import GetEstimateReport

from lupin_twin.estimate_report import REPORT_SERVICE
from lupin_twin.estimates import FIRST_FIT
from tests.support.domains import own_domain
from tests.support.messages import scan
from tests.support.processes import lupin_twin, twin_node, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S

HEARD = ("temperature", "humidity", "co2", "light", "soil_moisture")


def serves(peer: Peer, sensor: str) -> bool:
    """Whether a model does."""
    answer = peer.ask(GetEstimateReport, f"/{REPORT_SERVICE}", sensor_type=sensor)
    return bool(answer.fitted_at.sec)


def soonest(peer: Peer) -> str:
    """By sensor, s from now until a model of it serves; each is asked for in turn."""
    began_s, left, found = time.monotonic(), list(HEARD), dict[str, float]()
    while left and time.monotonic() - began_s < PATIENCE_S:
        for sensor in left[:]:
            if serves(peer, sensor):
                found[sensor] = time.monotonic() - began_s
                left.remove(sensor)
    never = float("inf")
    return ", ".join(f"{sensor} {found.get(sensor, never):.2f}" for sensor in HEARD)


def of_ten_scans() -> str:
    """Of scans that come at once, each of all sensors."""
    with own_domain() as domain, twin_node(domain), Peer(domain) as peer:
        peer.wait_for_twin()
        serves(peer, HEARD[0])  # that the service is found takes a while too
        for number in range(FIRST_FIT):
            values = dict.fromkeys(HEARD, 20.0 + number % 3)
            peer.observe(scan(f"tag-{number}", values, at=(1.0 + number / 5.0, number / 1.5)))
        return soonest(peer)


def of_a_demo() -> str:
    with own_domain() as domain, Peer(domain) as peer, lupin_twin(domain, "demo") as demo:
        url_of(demo)
        return soonest(peer)


def main() -> None:
    print(f"s from the tenth scan to the first model: {of_ten_scans()}")
    print(f"the same of a demo, s from its first answer: {of_a_demo()}")


if __name__ == "__main__":
    main()
