"""L2 error of waypoints under the averagings in use. They differ by a factor of two on the same trajectories.

stp3             "L2 at T s" is the mean of all steps up to T; a sample counts only where all six true waypoints are
                 known (ST-P3, Hu et al. 2022, and VAD, Jiang et al. 2023).
uniad            L2 of the step T itself, over the samples in which that step is known.
uniad-published  the same as UniAD's code publishes it (Hu et al. 2023, `planning_metrics.py`): a step that is not known
                 counts as an error of 0, and the sum is divided by all samples. Never above `uniad`.
openemma         OpenEMMA's means up to T with each waypoint compared at its own time: frame by frame the figures of
                 `stp3`. A perfect prediction scores 0.
openemma-code    the lines that OpenEMMA published (Xing et al. 2025, `main.py`). Its trajectory begins with the present
                 position, which is skipped for "1 s" (`pred_traj[1:3]` beside `truth[0:2]`) and not for "2 s" and "3 s"
                 (`pred_traj[:4]` beside `truth[:4]`): there each waypoint is compared with the truth half a second
                 later. A perfect prediction at 8 m/s scores 0.00 / 4.00 / 4.00.

A failure is a prediction that is more than 10 m off within the first second (OpenEMMA; paper, caption of Fig. 17), or
an answer without waypoints. OpenEMMA leaves failures out of the means, which makes a model that fails look better; so
every mean is given twice, and where failures count, an answer without waypoints is a car that stays where it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from chauffeur.foreign.waypoints import FUTURE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

Convention = Literal["stp3", "uniad", "uniad-published", "openemma", "openemma-code"]
CONVENTIONS: Final[tuple[Convention, ...]] = get_args(Convention)
FAILS_M: Final = 10.0
_STEPS: Final = (2, 4, 6)
"""Waypoints up to 1, 2 and 3 s."""


@dataclass(frozen=True, slots=True)
class L2Errors:
    """Of one prediction, m; None where the truth is not known.

    Attributes:
        at_1s, at_2s, at_3s: The three columns of the convention.
    """

    at_1s: float | None
    at_2s: float | None
    at_3s: float | None

    @property
    def average(self) -> float | None:
        """Mean of the three; None where one is missing."""
        if self.at_1s is None or self.at_2s is None or self.at_3s is None:
            return None
        return (self.at_1s + self.at_2s + self.at_3s) / 3.0


def distances(predicted: FloatArray, truth: FloatArray) -> FloatArray:
    """Of each waypoint from the true one, (steps,), m; NaN where the truth is not known.

    Args:
        predicted: (steps, 2).
        truth: (steps, 2), NaN where the log had ended.
    """
    return np.hypot(*(predicted - truth).T)


def lagging(predicted: FloatArray, truth: FloatArray) -> FloatArray:
    """Distance of each true waypoint from the predicted position half a second before it, (6,), m; arguments as in
    `distances`. The first is compared with the present position, the origin of the ego frame."""
    return distances(np.vstack([np.zeros((1, 2)), predicted[:-1]]), truth)


def averaged(away: Sequence[float | None], lagged: Sequence[float | None], convention: Convention) -> L2Errors:
    """The three columns of a convention.

    Args:
        away: `distances` of a sample, m; None where the truth is not known.
        lagged: `lagging` of the same sample, m.
        convention: Which averaging.
    """
    if convention in ("uniad", "uniad-published"):
        unknown = 0.0 if convention == "uniad-published" else None
        return L2Errors(*(unknown if away[i - 1] is None else away[i - 1] for i in _STEPS))
    own = [one for one in away if one is not None]
    late = [one for one in lagged if one is not None]
    if len(own) < FUTURE or len(late) < FUTURE:
        return L2Errors(None, None, None)
    first, second, third = (sum(own[:i]) / i for i in _STEPS)
    if convention == "openemma-code":
        second, third = (sum(late[:i]) / i for i in _STEPS[1:])
    return L2Errors(first, second, third)


def known(values: FloatArray) -> list[float | None]:
    """Distances as `averaged` takes them: None in place of NaN."""
    return [float(one) if np.isfinite(one) else None for one in values]


def errors(predicted: FloatArray, truth: FloatArray, convention: Convention) -> L2Errors:
    """L2 of a prediction (6, 2) under a convention; the truth as in `distances`."""
    return averaged(known(distances(predicted, truth)), known(lagging(predicted, truth)), convention)


def fails(predicted: FloatArray | None, truth: FloatArray) -> bool:
    """True if a prediction (6, 2) is a failure: none at all, or more than 10 m off within the first second."""
    if predicted is None:
        return True
    return bool((distances(predicted, truth)[:2] > FAILS_M).any())


def standing(steps: int = FUTURE) -> FloatArray:
    """A car that stays where it is, (steps, 2): what an answer without waypoints counts as."""
    return np.zeros((steps, 2))
