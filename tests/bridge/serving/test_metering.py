"""Every HTTP answer is counted, by its status and its kind of route."""

import pytest

from lupin_bridge.metrics import route_class
from tests.support.access import BEARER, TOKEN, served
from tests.support.processes import limits


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("/api/state", "state"),
        ("/api/tags/1/history", "tags"),
        ("/api/field.npy", "field"),
        ("/api/field/quality", "field"),
        ("/api/anything", "other"),
        ("/api", "page"),
        ("/metrics", "health"),
        ("/docs", "docs"),
        ("/assets/x.js", "page"),
    ],
)
def test_each_path_belongs_to_one_of_a_few_kinds(path: str, expected: str) -> None:
    assert route_class(path) == expected


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
            "lupin_work_abandoned_total 0.0",
        ):
            assert f"\n{line}\n" in metrics
