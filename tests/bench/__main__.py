"""`make bench`: every benchmark in turn; ratios side by side, nothing asserted."""

import importlib
import os
import sys

from tests.support.state_home import use_own

# In the order of the data flow: field, truth, journal, past, bridge, page.
BENCHES = (
    "bench_field",
    "bench_estimate",
    "bench_estimate_checks",
    "bench_estimate_many",
    "bench_estimate_speed",
    "bench_log",
    "bench_alarms",
    "bench_page",
    "bench_import",
    "bench_fleet",
    "bench_overview",
)


def main() -> int:
    use_own()
    # As in the twin, and before anything imports numpy.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    for name in sys.argv[1:] or BENCHES:
        print(f"\n=== {name}", flush=True)
        importlib.import_module(f"tests.bench.{name}").main()
    return 0


if __name__ == "__main__":
    sys.exit(main())
