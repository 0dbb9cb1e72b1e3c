"""Metrics as Prometheus reads them, from a real bridge with a real twin."""

import httpx
from prometheus_client.parser import text_string_to_metric_families
from websockets.sync.client import connect

from lupin_bridge.metrics import CONTENT_TYPE, METRICS, route_class
from tests.support.access import BEARER, TOKEN, served
from tests.support.messages import scan
from tests.support.processes import limits, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for

CO2 = {"sensor_type": "co2"}


def scrape(url: str) -> dict[str, float]:
    response = httpx.get(f"{url}/metrics", timeout=PATIENCE_S)
    assert response.headers["content-type"] == CONTENT_TYPE
    return {
        sample.name: sample.value
        for family in text_string_to_metric_families(response.text)
        for sample in family.samples
        if "le" not in sample.labels
    }


def test_every_metric_exists_and_follows_what_happens(domain: int) -> None:
    with lupin_twin(domain, "serve") as process, Peer(domain) as peer:
        url = url_of(process)
        before = scrape(url)
        plain = {name: it.kind for name, it in METRICS.items() if not it.label}
        names = {f"{name}_total" if kind == "counter" else name for name, kind in plain.items()}
        names |= {"lupin_push_seconds_count", "lupin_field_seconds_count"}
        assert names <= set(before)
        assert (before["lupin_clients"], before["lupin_tags"]) == (0.0, 0.0)
        peer.wait_for_twin()
        with connect(url.replace("http", "ws") + "/ws/state", open_timeout=PATIENCE_S) as client:
            client.recv()
            peer.observe(scan("1", frame_id="odom"), scan("1", frame_id="odom"))
            peer.observe(scan("1", {"co2": 500.0}, at=(1, 1)), scan("2", {"co2": 500.0}))
            wait_for(lambda: scrape(url)["lupin_tags"] == 2.0, "both tags")
            for suffix in ("json", "npy", "json"):
                httpx.get(f"{url}/api/field.{suffix}", params=CO2, timeout=PATIENCE_S)
            after = scrape(url)
            text = httpx.get(f"{url}/metrics", timeout=PATIENCE_S).text
            assert 'lupin_dropped_total{reason="frame"} 2.0' in text
            assert 'lupin_dropped_total{reason="lost"} 0.0' in text
            [drop] = httpx.get(f"{url}/readyz", timeout=PATIENCE_S).json()["drops"]
            assert (drop["reason"], drop["count"]) == ("frame", 2)
            assert "'odom'" in drop["message"]
        assert after["lupin_clients"] == 1.0
        assert after["lupin_frames_sent_total"] >= 2.0
        assert after["lupin_bytes_sent_total"] > 100.0
        assert after["lupin_push_seconds_count"] > before["lupin_push_seconds_count"]
        assert after["lupin_field_seconds_count"] == 2.0
        assert (after["lupin_ros_thread_alive"], after["lupin_twin_live"]) == (1.0, 1.0)
        assert after["lupin_state_age_seconds"] < 3.0
        assert after["lupin_ros_callback_errors_total"] == 0.0


def test_each_path_belongs_to_one_of_a_few_kinds() -> None:
    kinds = {
        "/api/state": "state",
        "/api/tags/1/history": "tags",
        "/api/field.npy": "field",
        "/api/field/quality": "field",
        "/api/anything": "other",
        "/api": "page",
        "/metrics": "health",
        "/docs": "docs",
        "/assets/x.js": "page",
    }
    assert {path: route_class(path) for path in kinds} == kinds


def test_answers_are_counted_by_status_and_timed_by_route() -> None:
    of_path = ("--path-prefix", "/gh1")  # which a proxy may strip, or not
    with served(*limits(answers_per_s=0.01), *of_path, LUPIN_TOKEN=TOKEN) as bridge:
        query = "&resolution=1&bbox_min_x=0&bbox_min_y=0&bbox_max_x=4&bbox_max_y=4"
        assert bridge.get("/api/state").status_code == 401
        assert bridge.get("/api/state", {"Host": "evil.example"}).status_code == 403
        with bridge.client("127.0.9.1", headers=BEARER) as client:
            statuses = [
                client.get(f"{prefix}/api/field?sensor_type={sensor}{query}").status_code
                for prefix, sensor in (("/gh1", "a"), ("/gh1", "b"), ("", "c"))
            ]
        assert statuses == [200, 429, 429]
        metrics = bridge.get("/metrics", BEARER).text
        for line in (
            'lupin_http_answers_total{status="401"} 1.0',
            'lupin_http_answers_total{status="403"} 1.0',
            'lupin_http_answers_total{status="429"} 2.0',
            'lupin_admission_refused_total{reason="client_rate"} 2.0',
            'lupin_http_seconds_count{route="field"} 3.0',
        ):
            assert f"\n{line}\n" in metrics
