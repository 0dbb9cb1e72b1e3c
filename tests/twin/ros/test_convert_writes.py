"""Writes on the wire: as values for robots, and as rows for copies of the log."""

import pytest

from lupin_twin.journal.follow import Lot, NotALotError
from lupin_twin.ros.convert_services import lot_of, rows_response

LOT = Lot("0123456789abcdef" * 2, ('["run",1,0,1,1,1,null,null]', '["meta","ä","5"]'), 9, True)


@pytest.mark.parametrize(
    "lot",
    [
        LOT._replace(last=7),
        LOT._replace(last=8, is_all=False),
        LOT._replace(journal="../../home"),
        LOT._replace(journal=""),
        LOT._replace(rows=("[]",) * 500_001),
    ],
)
def test_a_batch_without_a_next_number_or_a_journal_is_invalid(lot: Lot) -> None:
    with pytest.raises(NotALotError):
        lot_of(rows_response(lot), 8)
