"""L2 error of waypoints under the three conventions in use. They differ by a factor of two on the same trajectories.

stp3      "L2 at T s" is the mean of all steps up to T; a sample counts only where all six true waypoints are known
          (ST-P3, Hu et al. 2022, and VAD).
uniad     L2 of the step at T itself; each step counts where its true waypoint is known (UniAD, Hu et al. 2023).
openemma  as stp3, except that over the first second the predictions one step later are compared with the truth
          (`prediction[1:3]` with `truth[0:2]`), as the published code of OpenEMMA does (Xing et al. 2025). The paper's
          Tab. XII follows it.

A failure is a prediction that is more than 10 m off within the first second (OpenEMMA; paper, caption of Fig. 17), or
an answer without waypoints. OpenEMMA leaves failures out of the means, which makes a model that fails look better; so
every mean is given twice, and where failures count, an answer without waypoints is a car that stays where it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from chauffeur.bench.openloop.nuscenes import FUTURE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

Convention = Literal["stp3", "uniad", "openemma"]
CONVENTIONS: Final[tuple[Convention, ...]] = ("stp3", "uniad", "openemma")
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
    """Of each waypoint from the true one, (6,), m; NaN where the truth is not known.

    Args:
        predicted: (6, 2).
        truth: (6, 2), NaN where the log had ended.
    """
    return np.hypot(*(predicted - truth).T)


def errors(predicted: FloatArray, truth: FloatArray, convention: Convention) -> L2Errors:
    """L2 of a prediction (6, 2) under a convention; the truth as in `distances`."""
    away = distances(predicted, truth)
    if convention == "uniad":
        return L2Errors(*(None if np.isnan(away[i - 1]) else float(away[i - 1]) for i in _STEPS))
    if np.isnan(away).any():
        return L2Errors(None, None, None)
    first, second, third = (float(away[:i].mean()) for i in _STEPS)
    if convention == "openemma":
        first = float(np.hypot(*(predicted[1:3] - truth[:2]).T).mean())
    return L2Errors(first, second, third)


def fails(predicted: FloatArray | None, truth: FloatArray) -> bool:
    """Whether a prediction (6, 2) is a failure: none at all, or more than 10 m off within the first second."""
    if predicted is None:
        return True
    return bool((distances(predicted, truth)[:2] > FAILS_M).any())


def standing() -> FloatArray:
    """A car that stays where it is, (6, 2): what an answer without waypoints counts as."""
    return np.zeros((FUTURE, 2))


def scored(predicted: FloatArray | None, truth: FloatArray) -> Mapping[Convention, L2Errors]:
    """All conventions."""
    found = standing() if predicted is None else predicted
    return {one: errors(found, truth, one) for one in CONVENTIONS}
