"""A person's taste from feedback on any wish (paper Eq. 21-23, H).

Feedback on nearly the same wish is followed as it stands (`planner.recalled`). Most wishes come in other words, and who
found one drive too harsh will often find another so. Here all judged drives of a person count, less where wish, style
or weather were others, towards one number: by how much more careful (positive) or bolder than their words alone ask
for the gains are to be, on the scale of `safety.gain_box.care`.

A drive that was too harsh says that the wanted shift lies some way above the one that was driven, too timid some way
below, liked near it; people put up with some error, and are not the same every day. Before any feedback the shift is
thought to be small. The estimate is the mean of what is then believed (Bayes, on a grid).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import erf, sqrt
from typing import Any, Final

import numpy as np

from chauffeur.concept import Feedback, HistoryItem

Array = np.ndarray[Any, Any]

TASTE_SETTING: Final = "taste"
STYLE_SETTING: Final = "style"
WEATHER_SETTING: Final = "weather"
"""Among a plan's settings: the shift it was made with, and the places of the style it heard and the weather it took in
the template's lists."""
STEP: Final = 0.28
"""One style gentler or brisker, on the scale of `care`."""
_SHIFTS: Final[Array] = np.linspace(-0.45, 0.45, 91)
_SPREAD: Final = 0.12
"""Standard deviation of what people want beside the style's own gains, before anything is known of them."""
_DAILY: Final = 0.08
_TOLERATED: Final = 0.15
_MARGINS: Final = ((0.5, 0.15), (0.9, 0.20), (1.1, 0.30))
"""(Strength of feedback below which it counts so, how far off the drive was at least)."""
_OTHER_WISH, _OTHER_WEATHER, _OTHER_STYLE = 0.6, 0.6, 0.7
"""What a drive counts that differs from the present one in it."""


@dataclass(frozen=True, slots=True)
class JudgedDrive:
    """A drive that somebody had something to say of.

    Attributes:
        sign: -1 it was too much (too harsh, fast or close), 1 too little, 0 as it should be.
        strength: Of the feedback, 0 to 1.
        shift: By how much more careful than the words alone it was.
        weight: What it counts for the present wish, 0 to 1.
    """

    sign: int
    strength: float
    shift: float
    weight: float


def sign_of(feedback: Feedback) -> int:
    """-1 for a drive that was too much, 1 too little, 0 for neither."""
    signs = [sign for sign in (feedback.comfort, feedback.speed, feedback.gap) if sign]
    return 0 if not signs else 1 if sum(signs) > 0 else -1


def judged_drives(items: Iterable[HistoryItem], style: int, weather: int, similar: float) -> list[JudgedDrive]:
    """The drives among remembered ones that say something of a person's taste.

    Args:
        items: Of the same intent.
        style, weather: Places in the template's lists; 0 is sunshine.
        similar: From this similarity on a wish is the present one.
    """
    found: list[JudgedDrive] = []
    for item in items:
        if not item.feedback:
            continue
        said, held = item.feedback[-1], dict(item.settings)
        sign = sign_of(said)
        if not sign and said.approval <= 0:
            continue
        weight = 1.0 if item.similarity >= similar else _OTHER_WISH
        if held.get(STYLE_SETTING) != float(style):
            weight *= _OTHER_STYLE
        if (held.get(WEATHER_SETTING) == 0.0) != (weather == 0):
            weight *= _OTHER_WEATHER
        found.append(JudgedDrive(sign, said.strength, held.get(TASTE_SETTING, 0.0), weight))
    return found


def taste_of(drives: Iterable[JudgedDrive]) -> float:
    """By how much more careful than their words alone a person likes to be driven; 0 where nothing is known."""
    believed = -0.5 * (_SHIFTS / _SPREAD) ** 2
    known = False
    for drive in drives:
        off = _SHIFTS - drive.shift
        if drive.sign:
            margin = next(least for below, least in _MARGINS if drive.strength < below)
            likely = _normal((-drive.sign * off - margin) / _DAILY)
        else:
            likely = _normal((_TOLERATED - off) / _DAILY) * _normal((_TOLERATED + off) / _DAILY)
        believed = believed + drive.weight * np.log(likely + 1e-9)
        known = True
    if not known:
        return 0.0
    shares = np.exp(believed - believed.max())
    return float((shares * _SHIFTS).sum() / shares.sum())


def _normal(values: Array) -> Array:
    """Standard normal distribution function."""
    return np.array([0.5 * (1.0 + erf(value / sqrt(2.0))) for value in values.tolist()])
