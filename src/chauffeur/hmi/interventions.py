"""What the run-time shield did in a drive: its changes put together to stretches of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from chauffeur.concept import Command, Frame, Intervention

_PAUSE_S = 0.45
"""Changes by one rule that are no further apart are one stretch."""


@dataclass(frozen=True, slots=True)
class ShieldedStretch:
    """A time during which a rule changed commands.

    Attributes:
        rule: The rule.
        reason: In the shield's words, of the greatest change.
        start_s, end_s: When; the end is that of the last period changed.
        changes: Control periods changed.
        before, after: The command as it came and as it went on, of the greatest change.
    """

    rule: str
    reason: str
    start_s: float
    end_s: float
    changes: int
    before: Command
    after: Command


def stretches_of(frames: Sequence[Frame]) -> tuple[ShieldedStretch, ...]:
    """All stretches of a drive, in order of their beginning."""
    times = [frame.observation.time_s for frame in frames]
    period_s = min((after - before for before, after in pairwise(times)), default=0.0)
    done: list[ShieldedStretch] = []
    running: dict[str, ShieldedStretch] = {}
    for frame in frames:
        now = frame.observation.time_s
        for change in frame.interventions:
            before = running.get(change.rule)
            if before is not None and now - before.end_s <= _PAUSE_S:
                running[change.rule] = _longer(before, change, now + period_s)
                continue
            if before is not None:
                done.append(before)
            running[change.rule] = ShieldedStretch(
                change.rule, change.reason, now, now + period_s, 1, change.before, change.after
            )
    return tuple(sorted((*done, *running.values()), key=lambda stretch: (stretch.start_s, stretch.rule)))


def _longer(stretch: ShieldedStretch, change: Intervention, end_s: float) -> ShieldedStretch:
    longer = replace(stretch, end_s=end_s, changes=stretch.changes + 1)
    if _size(change.before, change.after) <= _size(stretch.before, stretch.after):
        return longer
    return replace(longer, reason=change.reason, before=change.before, after=change.after)


def _size(before: Command, after: Command) -> tuple[float, float]:
    """How great a change is; any of the steering counts more than all of the pedals."""
    return abs(after.steering_rad - before.steering_rad), abs(after.acceleration_mps2 - before.acceleration_mps2)
