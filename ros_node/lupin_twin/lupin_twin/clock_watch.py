"""Whether ROS time runs, told from ROS time, a steady clock and the messages on `/clock`. Pure.

Ages by a clock that does not run are no ages: an observation of an hour ago would look new for as
long as nobody moves the clock. So whoever shows an age asks here first.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from lupin_twin.state import ClockState

# A clock that has not moved for so long, s of steady time, does not run.
STANDS_AFTER_S: Final = 3.0
# What a twin says of its clock, once a second, is true of so long ago, s, with room for a slow one.
REPORT_LAG_S: Final = 2.0
# From here on it is worth listening whether `/clock` still comes.
LISTEN_AFTER_S: Final = 1.0
CLOCK_SAYS: Final[Mapping[ClockState, str]] = {
    "running": "ROS time runs",
    "paused": "ROS time is paused: /clock is published and stands",
    "stopped": "ROS time has stopped, nothing comes on /clock: ages are not known until it does",
    "none": "there is no ROS time yet (use_sim_time, and nothing on /clock): ages are not known",
}


class ClockWatch:
    """Follows one clock; times are ROS time in ns, and s of a clock that never jumps."""

    def __init__(self) -> None:
        self.state: ClockState = "none"
        self.wants_to_listen = False
        self._last_ns = 0
        self._moved_s = 0.0
        self._heard_s: float | None = None

    def hear(self, now_s: float) -> None:
        """A message came on `/clock`, whatever it says."""
        self._heard_s = now_s

    def look(self, ros_ns: int, now_s: float, *, is_simulated: bool) -> ClockState:
        """Note the time, and tell how the clock does.

        A clock that is not simulated is the system's, and runs. One that is simulated and was never
        set is at 0.
        """
        if ros_ns != self._last_ns:
            self._last_ns, self._moved_s = ros_ns, now_s
        standing_s = now_s - self._moved_s
        self.wants_to_listen = is_simulated and ros_ns > 0 and standing_s >= LISTEN_AFTER_S
        if not self.wants_to_listen:
            self._heard_s = None
        self.state = self._state(ros_ns, now_s, standing_s, is_simulated=is_simulated)
        return self.state

    def _state(
        self, ros_ns: int, now_s: float, standing_s: float, *, is_simulated: bool
    ) -> ClockState:
        if not is_simulated:
            return "running"
        if ros_ns <= 0:
            return "none"
        if standing_s < STANDS_AFTER_S:
            return "running"
        is_heard = self._heard_s is not None and now_s - self._heard_s < STANDS_AFTER_S
        return "paused" if is_heard else "stopped"


class StampWatch:
    """Tells how a twin's clock does, for who hears its states from elsewhere.

    A stamp that stands may be that of a clock that is paused, and then only the twin itself knows.
    Where it does not say so, the clock has stopped: nobody is told that all is well on a guess.
    """

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._has_moved = False
        self._moved_s = 0.0

    def look(
        self,
        stamp_ns: int,
        now_s: float,
        *,
        ages_are_known: bool,
        reported: ClockState | None = None,
    ) -> ClockState:
        """Note a state's stamp; `ages_are_known`: the twin gave no age as NaN.

        `reported` is what the twin said of its clock just now, up to `REPORT_LAG_S` behind what its
        states say; None: nothing.
        """
        if stamp_ns != self._last_ns:
            self._has_moved = self._last_ns is not None
            self._last_ns, self._moved_s = stamp_ns, now_s
        if stamp_ns <= 0:
            return "none"
        if not ages_are_known:
            return "doubted" if reported == "doubted" else "stopped"
        standing_s = now_s - self._moved_s
        if reported == "paused" and (standing_s >= STANDS_AFTER_S or not self._has_moved):
            return "paused"
        lag_s = REPORT_LAG_S if reported == "running" else 0.0
        return "running" if standing_s < STANDS_AFTER_S + lag_s else "stopped"
