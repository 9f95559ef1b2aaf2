"""What a notebook shows of a drive: the player, tables, plots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from importlib import import_module
from typing import Any, Final

import numpy as np

from chauffeur.concept import Frame, MissingExtraError, result_of
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi.document import printable
from chauffeur.hmi.page import render_page

MAX_HTML_CHARACTERS: Final = 4_000_000
"""Largest player that is put into a notebook, which stores it with the cell; a drive of 11 s takes 150,000."""
_HEIGHT_PX: Final = 760
"""The road, the instruments and the time line of the player, without scrolling."""

_COLUMNS: Final[dict[str, Callable[[Frame], Any]]] = {
    "time_s": lambda frame: frame.observation.time_s,
    "x_m": lambda frame: frame.observation.ego.x_m,
    "y_m": lambda frame: frame.observation.ego.y_m,
    "heading_rad": lambda frame: frame.observation.ego.heading_rad,
    "speed_mps": lambda frame: frame.observation.ego.speed_mps,
    "lane": lambda frame: frame.observation.ego.lane,
    "target_speed_mps": lambda frame: frame.setpoints.target_speed_mps,
    "target_headway_s": lambda frame: frame.setpoints.time_headway_s,
    "target_lane": lambda frame: frame.setpoints.target_lane,
    "gap_m": lambda frame: frame.observation.front and frame.observation.front.distance_m,
    "lead_speed_mps": lambda frame: frame.observation.front and frame.observation.front.speed_mps,
    "requested_acceleration_mps2": lambda frame: frame.requested.acceleration_mps2,
    "requested_steering_rad": lambda frame: frame.requested.steering_rad,
    "applied_acceleration_mps2": lambda frame: frame.applied.acceleration_mps2,
    "applied_steering_rad": lambda frame: frame.applied.steering_rad,
    "program": lambda frame: frame.program,
    "program_line": lambda frame: frame.line,
    "shield": lambda frame: ", ".join(one.rule for one in frame.interventions),
    "said": lambda frame: " ".join(frame.said),
}


class Drive(RecordedTrip):
    """A drive that a notebook can show: the last line of a cell plays it.

    >>> drive = chauffeur.drive("Change to the left lane.", scenario="cruise")
    >>> drive.trip.plan.intent, len(drive.columns()["speed_mps"]) == len(drive.frames)
    ('lane.left', True)
    """

    __slots__ = ()

    @classmethod
    def of(cls, recorded: RecordedTrip) -> Drive:
        """A recorded trip, such as `read_trip` reads from a file, as a drive."""
        return cls(**{one.name: getattr(recorded, one.name) for one in fields(recorded)})

    def __repr__(self) -> str:
        """One line."""
        return f"<Drive {result_of(self.trip)}: {self.trip.summary}>"

    def _repr_html_(self) -> str:
        """The trip page in a frame of its own; a line of text where it would be too large."""
        page = render_page(self).replace("&", "&amp;").replace("'", "&#x27;")
        if len(page) > MAX_HTML_CHARACTERS:
            return (
                f"<p>{len(self.frames)} control periods are too many to play here: "
                "drive with <code>save=</code> and run <code>chauffeur show page</code> on the recording.</p>"
            )
        return (
            '<iframe sandbox="allow-scripts" title="The drive" '
            f"style=\"width:100%;height:{_HEIGHT_PX}px;border:0\" srcdoc='{page}'></iframe>"
        )

    def columns(self) -> dict[str, list[Any]]:
        """One value a control period in each column, as any table library takes them; None where there was none.

        `gap_m` is from centre to centre, as on the trip page. Set-points are `target_...`; None of one keeps what is.
        """
        return {name: [value(frame) for frame in self.frames] for name, value in _COLUMNS.items()}

    def frame(self) -> Any:
        """`columns()` as a `pandas.DataFrame`. Raises MissingExtraError: pandas is not installed."""
        return library("pandas", "A data frame").DataFrame(self.columns())

    def plot(self) -> tuple[Any, Any]:
        """Plot speed with its set-point, and the gap, over time; returns both `matplotlib` axes.

        Raises:
            MissingExtraError: matplotlib is not installed.
        """
        pyplot = library("matplotlib.pyplot", "A plot")
        columns = self.columns()
        figure, (speed, gap) = pyplot.subplots(2, sharex=True, layout="constrained")
        figure.suptitle(printable(self.trip.summary), fontsize="small", parse_math=False)
        for axes, name, label in (
            (speed, "speed_mps", "speed"),
            (speed, "target_speed_mps", "set-point"),
            (gap, "gap_m", "gap to the vehicle ahead"),
        ):
            axes.plot(columns["time_s"], np.array(columns[name], dtype=float), label=label)
        speed.set_ylabel("speed, m/s")
        speed.legend()
        gap.set(xlabel="time, s", ylabel="gap (centre to centre), m")
        return speed, gap


def library(name: str, need: str) -> Any:
    """A module of the extra `notebook`. Raises MissingExtraError: it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtraError(f"{need} needs {name.partition('.')[0]}.", extra="notebook") from error
