"""The certified box of gains: what an action matrix may hold (paper Eq. 22), published in `gain_box.json` beside this.

Every value was driven: `benchmarks/gain_box.py` drew gain sets from the box, drove each on three plants that are not
the controllers' own model, and cut the box until none of them broke a bound. The file holds box, bounds and the worst.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from statistics import fmean
from typing import Any, Final

from chauffeur.concept import ActionMatrix

GAIN_NAMES: Final = ("Kp", "Ki", "Kd", "Wl", "Wh", "Ws")
LOGARITHMIC: Final = frozenset({"kp", "wl", "wh", "ws"})
"""Gains, in small letters, that span orders of magnitude: what counts of them are ratios."""
CAREFUL_WHEN_LOW: Final[Mapping[str, bool]] = {
    "kp": True, "ki": True, "kd": False, "wl": True, "wh": True, "ws": False,
}  # fmt: skip
"""True for gains that are the more conservative the lower they are."""
_ROUNDING: Final = 1e-9
_DIGITS: Final = 4


@dataclass(frozen=True, slots=True)
class GainBox:
    """Lowest and highest certified value of each gain, by its name in `GAIN_NAMES`, and how it was certified."""

    low: dict[str, float]
    high: dict[str, float]
    certificate: dict[str, Any]

    def outside(self, policy: ActionMatrix) -> list[tuple[str, float]]:
        """Gains beyond the box, as (name, value); what is no number is beyond it."""
        values = zip(GAIN_NAMES, (*policy.pid, *policy.mpc), strict=False)
        return [
            (name, value)
            for name, value in values
            if not self.low[name] - _ROUNDING <= value <= self.high[name] + _ROUNDING
        ]

    def clamped(self, policy: ActionMatrix) -> ActionMatrix:
        """The nearest action matrix inside."""
        kept = [
            min(max(value, self.low[name]), self.high[name])
            for name, value in zip(GAIN_NAMES, (*policy.pid, *policy.mpc), strict=True)
        ]
        return ActionMatrix((kept[0], kept[1], kept[2]), (kept[3], kept[4], kept[5]))


@cache
def gain_box() -> GainBox:
    """The box that ships."""
    found = json.loads(resources.files(__package__ or "").joinpath("gain_box.json").read_text(encoding="utf-8"))
    low, high = ({name: float(found["box"][name.lower()][end]) for name in GAIN_NAMES} for end in (0, 1))
    return GainBox(low, high, found)


def values_of(policy: ActionMatrix) -> dict[str, float]:
    """Gains by name, `kp` ... `ws`."""
    return dict(zip((name.lower() for name in GAIN_NAMES), (*policy.pid, *policy.mpc), strict=True))


def care(policy: ActionMatrix) -> float:
    """Conservatism of gains: 0 the most aggressive corner of the certified box, 1 the most conservative one."""
    return fmean(_care_shares(policy))


def more_careful(policies: Iterable[ActionMatrix]) -> ActionMatrix:
    """Of several gains, those of the most `care`; the first of equals."""
    return max(policies, key=care)


def most_careful() -> ActionMatrix:
    """The most conservative corner of the certified box: no gains have more `care`."""
    box = gain_box()
    kp, ki, kd, wl, wh, ws = ((box.low if CAREFUL_WHEN_LOW[n.lower()] else box.high)[n] for n in GAIN_NAMES)
    return ActionMatrix((kp, ki, kd), (wl, wh, ws))


def moved(policy: ActionMatrix, by: float) -> ActionMatrix:
    """Gains that are more careful (`by` positive) or bolder, on the scale of `care`; each stays within the box."""
    box = gain_box()
    found: list[float] = []
    for name, share in zip(values_of(policy), _care_shares(policy), strict=True):
        low, high = box.low[name.capitalize()], box.high[name.capitalize()]
        share = min(max(share + by, 0.0), 1.0)  # noqa: PLW2901
        at = 1.0 - share if CAREFUL_WHEN_LOW[name] else share
        value = math.exp(math.log(low) + at * math.log(high / low)) if name in LOGARITHMIC else low + at * (high - low)
        found.append(round(value, _DIGITS))
    return box.clamped(ActionMatrix((found[0], found[1], found[2]), (found[3], found[4], found[5])))


def _care_shares(policy: ActionMatrix) -> list[float]:
    """Of each gain: 0 where it is at its most aggressive certified value, 1 at its most conservative one."""
    box = gain_box()
    shares: list[float] = []
    for name, value in values_of(policy).items():
        low, high = box.low[name.capitalize()], box.high[name.capitalize()]
        if name in LOGARITHMIC:
            low, high, value = math.log(low), math.log(high), math.log(max(value, 1e-9))  # noqa: PLW2901
        share = min(max((value - low) / (high - low), 0.0), 1.0)
        shares.append(1.0 - share if CAREFUL_WHEN_LOW[name] else share)
    return shares
