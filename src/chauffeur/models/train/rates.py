"""Learning rates over the steps of a training."""

from __future__ import annotations

import math


def cosine_rate(step: int, steps: int, highest: float, warmup: int, floor: float) -> float:
    """Up in a line over `warmup` steps, and all the while down along a cosine (Loshchilov and Hutter 2017).

    Args:
        step: From 0.
        steps: Of the whole training.
        highest: What warming up leads to.
        warmup: See there.
        floor: Share of it that is left in the end.
    """
    warm = min(1.0, (step + 1) / warmup)
    return highest * warm * (floor + (1.0 - floor) * 0.5 * (1.0 + math.cos(math.pi * min(1.0, step / steps))))
