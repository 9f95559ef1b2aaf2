"""The weathers of the paper's Fig. 13, which cameras render and roads feel."""

from __future__ import annotations

from typing import Final, Literal, get_args

Weather = Literal["sunny", "rain", "fog", "snow", "night"]
WEATHERS: Final[tuple[Weather, ...]] = get_args(Weather)
