"""Whether fits and estimates delay what is live: the same clients without them and with them.

Twenty WebSocket clients follow a robot at 10 Hz, whose readings are learnt from all the time, while
others ask, each one after the other, for the largest estimates there are, each of another box, and
for what they are worth.
"""

from __future__ import annotations

import random
import time

from tests.bench.live_parts import Clients, serving
from tests.bench.live_past import LIVE, RATE_HZ, Askers

_BOX = "bbox_min_x={x}&bbox_min_y=0&bbox_max_x={far}&bbox_max_y=10&resolution=0.01"
QUESTIONS = {
    "JSON 1000 x 1000": f"/api/estimate.json?sensor_type=temperature&{_BOX}",
    "NPY 1000 x 1000": f"/api/estimate.npy?sensor_type=humidity&{_BOX}",
    "PNG 1000 x 1000": f"/api/estimate.png?sensor_type=co2&layer=sd&{_BOX}",
    "of one tag that is read all the time": f"/api/estimate.npy?sensor_type=beat&{_BOX}",
    "quality": "/api/estimate/quality",
    "tags": "/api/estimate/tags?sensor_type=co2",
    "advice": "/api/estimate/advice?sensor_type=temperature&places=20",
}


def measure_estimates(seconds: float) -> str:
    """The delays of frames, without questions and with them; returns lines of text."""
    with serving(30, RATE_HZ) as server, Clients(server.port, LIVE) as clients:
        clients.joined_s()
        now_s = time.monotonic()
        without = clients.measure(now_s, now_s + seconds)
        askers = Askers(server.port, QUESTIONS, _some_box)
        askers.start()
        now_s = time.monotonic()
        beside = clients.measure(now_s, now_s + seconds)
        askers.stop()
    told = [f"{what} {n} x {status}" for (what, status), n in sorted(askers.answers.items())]
    share = 100 * beside.delivered(LIVE)
    lines = (
        f"{LIVE} clients at {RATE_HZ:g} Hz, {seconds:g} s each, 30 tags:",
        f"- nothing asked: {without.delays()}, {100 * without.delivered(LIVE):.2f} % delivered",
        f"- beside the dearest estimates: {beside.delays()}, {share:.2f} % delivered",
        f"- what was asked all the time, and got: {'; '.join(told)}",
    )
    return "\n".join(lines)


def _some_box(question: str, chance: random.Random) -> str:
    x = round(chance.uniform(0.0, 5.0), 3)
    return question.format(x=x, far=x + 10.0)
