from dataclasses import replace

from lupin_bridge.alarms.feed import writes_between
from lupin_twin.core.state import Flower, Inspection, Reading, Scan, Snapshot, TwinStore

NOW = 10**12


def after(store: TwinStore, *writes: Scan | Inspection) -> Snapshot:
    for write in writes:
        if isinstance(write, Scan):
            store.record(write)
        else:
            store.record_inspection(write)
    return store.snapshot(NOW, "map")


def test_what_is_new_is_told_once_in_the_order_of_time_and_numbered() -> None:
    store = TwinStore()
    pest = Flower(species="tulip", confidence=0.9, anomaly=True, bug_count=3)
    first = after(
        store,
        Scan("a", 5, (Reading("co2", 400.0), Reading("light", 1.0))),
        Inspection("a", 4, pest),
        Scan("b", 6, (), status=2),
    )
    told = writes_between(None, first, 7)
    assert [(w.number, w.tag_id, w.stamp_ns, w.kind, w.status) for w in told] == [
        (7, "a", 4, 1, 0),
        (8, "a", 5, 0, 0),
        (9, "b", 6, 0, 2),
    ]
    assert (told[0].species, told[0].anomaly, told[0].bug_count) == ("tulip", True, 3)
    assert (told[1].sensors, told[1].values) == (("co2", "light"), (400.0, 1.0))
    second = after(store, Scan("a", 9, (Reading("co2", 410.0),)))
    (new,) = writes_between(first, second, 10)
    assert (new.stamp_ns, new.sensors, new.values) == (9, ("co2",), (410.0,))
    assert writes_between(second, replace(second, stamp_ns=NOW + 1), 11) == []
