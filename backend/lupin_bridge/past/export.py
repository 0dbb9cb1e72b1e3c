"""The formats of an export: CSV, and Parquet by pyarrow. They do no input or output.

Rows are packed in the process that reads them, and written in the one that sends them: a Parquet
file has a head and a tail, so one writer has to see all of it. It holds at most one group of rows.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Mapping, Sequence
from typing import Any, Final

from lupin_bridge.judge.quantities import Sensors
from lupin_bridge.past import bodies
from lupin_twin.core.past import PastRow

# Rows in one group of a Parquet file: some megabytes until they are written.
GROUP_ROWS: Final = 50_000


class Csv:
    """CSV, sent as it was packed: call `begin`, then `add` for each packed lot, then `end`."""

    name = "csv"
    media_type = bodies.CSV_TYPE
    # Can be pickled.
    pack = staticmethod(bodies.csv_lines)

    def __init__(self, _sensors: Sensors, _sensor: str | None, has_site: bool) -> None:
        self._has_site = has_site

    def begin(self) -> bytes:
        """The bytes to send first."""
        header = bodies.CSV_HEADER
        return header.replace(b"\r", b",site\r") if self._has_site else header

    def add(self, packed: bytes) -> bytes:
        """The bytes to send after one more lot; maybe none."""
        return packed

    def end(self) -> bytes:
        """The bytes to send last."""
        return b""


# --- Parquet --------------------------------------------------------------------------------------

_OF_VALUES: Final = "see the column unit"
# Attributes of the CF conventions, where these define any.
_COLUMNS: Final[Mapping[str, Mapping[str, str]]] = {
    "time": {"standard_name": "time", "long_name": "ROS time of the scan"},
    "tag_id": {"long_name": "tag that was scanned"},
    "x_m": {"standard_name": "projection_x_coordinate", "units": "m", "axis": "X"},
    "y_m": {"standard_name": "projection_y_coordinate", "units": "m", "axis": "Y"},
    "sensor": {"long_name": "sensor; null: the attempt brought no reading"},
    "unit": {"long_name": "unit of the value"},
    "value": {"long_name": "reading", "coordinates": "time x_m y_m tag_id sensor"},
    "status": {
        "long_name": "status of the attempt",
        "flag_values": "0 1 2 3",
        "flag_meanings": "ok unreachable scan_failed skipped",
    },
    "source": {"long_name": "robot or program that scanned"},
    "site": {"long_name": "greenhouse"},
}


def _pack_columns(rows: Sequence[PastRow], sensors: Sensors, site: str | None = None) -> bytes:
    """Columns as lists, in the order of `_COLUMNS`; None: null."""
    texts: dict[str, str | None] = {"": None}

    def text(of: str) -> str | None:
        if of not in texts:
            texts[of] = of.encode("utf-8", "replace").decode()
        return texts[of]

    units = {row.sensor: text(sensors.named(row.sensor).unit) for row in rows if row.sensor}
    columns: list[list[Any]] = [
        [row.stamp_ns for row in rows],
        [text(row.tag_id) for row in rows],
        [bodies.finite(row.x) for row in rows],
        [bodies.finite(row.y) for row in rows],
        [text(row.sensor) for row in rows],
        [units.get(row.sensor) for row in rows],
        [bodies.finite(row.value) for row in rows],
        [row.status for row in rows],
        [text(row.source) for row in rows],
    ]
    if site is not None:
        columns.append([site] * len(rows))
    return pickle.dumps(columns, 5)


class _Sink(io.BytesIO):
    """Buffers what pyarrow writes until it is sent."""

    _sent = 0

    def tell(self) -> int:
        """The bytes written in all: pyarrow records the offsets of columns by them."""
        return self._sent + super().tell()

    def take(self) -> bytes:
        taken = self.getvalue()
        self._sent += len(taken)
        self.seek(0)
        self.truncate()
        return taken


class Parquet:
    """Parquet, written group by group of rows; creating it may take as long as an import."""

    name = "parquet"
    media_type = "application/vnd.apache.parquet"
    pack = staticmethod(_pack_columns)

    def __init__(self, sensors: Sensors, sensor: str | None, has_site: bool) -> None:
        import pyarrow  # noqa: PLC0415  # the extra `science`, slow to import
        from pyarrow import parquet  # noqa: PLC0415

        kinds = {
            "time": pyarrow.timestamp("ns", tz="UTC"),
            "status": pyarrow.uint8(),
            **dict.fromkeys(("x_m", "y_m", "value"), pyarrow.float64()),
        }
        # If there is only one sensor, all values have its unit.
        units = sensors.named(sensor).unit if sensor else _OF_VALUES
        described = {**_COLUMNS, "value": {**_COLUMNS["value"], "units": units}}
        self._schema = pyarrow.schema(
            [
                pyarrow.field(name, kinds.get(name, pyarrow.string()), metadata=attributes)
                for name, attributes in described.items()
                if has_site or name != "site"
            ]
        )
        self._sink = _Sink()
        self._writer: Any = parquet.ParquetWriter(self._sink, self._schema, compression="zstd")
        self._arrow: Any = pyarrow
        self._waiting: list[Any] = []
        self._rows = 0

    def begin(self) -> bytes:
        """See `Csv`."""
        return self._sink.take()

    def add(self, packed: bytes) -> bytes:
        """See `Csv`."""
        columns = pickle.loads(packed)  # noqa: S301  # of `_pack_columns`
        self._waiting.append(
            self._arrow.record_batch(
                [
                    self._arrow.array(values, field.type)
                    for values, field in zip(columns, self._schema, strict=True)
                ],
                schema=self._schema,
            )
        )
        self._rows += len(columns[0])
        if self._rows >= GROUP_ROWS:
            self._write()
        return self._sink.take()

    def end(self) -> bytes:
        """See `Csv`."""
        self._write()
        self._writer.close()
        return self._sink.take()

    def _write(self) -> None:
        table = self._arrow.Table.from_batches(self._waiting, self._schema)
        self._waiting, self._rows = [], 0
        if len(table):
            self._writer.write_table(table, row_group_size=len(table))
