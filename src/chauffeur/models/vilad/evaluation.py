"""Metrics of an evaluation: success with and without verification, what was understood, consistency, passes, latency;
and the linear reader with the exact solver beside it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from chauffeur.planners.vilad.engine import ViladEngine
from chauffeur.planners.vilad.template import ActionTemplate
from chauffeur.planners.vilad.unmasking import Decided, Predict, Unmasking, unmask

Array = np.ndarray[Any, Any]
Values = Mapping[str, str | int]


class Judged(NamedTuple):
    """Verdict on an answer.

    Attributes:
        success: It is what was meant.
        understood: Every criterion is as meant.
        consistent: Its parts fit together.
        faithful: What it does is what it says it understood.
    """

    success: bool
    understood: bool
    consistent: bool
    faithful: bool


class ViladCase(Protocol):
    """A command in a scene, and how answers to it are judged."""

    @property
    def text(self) -> str: ...
    @property
    def asked(self) -> Mapping[str, str]: ...
    @property
    def template(self) -> ActionTemplate: ...

    def features(self) -> Array:
        """Candidates of the scene."""
        ...

    def judged(self, values: Values) -> Judged:
        """Verdict on an answer."""
        ...

    def verified(self, predict: Predict, decided: Decided) -> Decided:
        """The answer that is driven."""
        ...

    def solved(self, asked: Mapping[str, str]) -> bool:
        """True if the exact answer to what a reader understood is what was meant."""
        ...


@dataclass(frozen=True, slots=True)
class ViladFigures:
    """Of one split, in percent of its commands.

    Attributes:
        count: Commands.
        success: The network's own answer is what was meant.
        verified: The answer that is driven is: made to agree with what it says it understood.
        solved: The exact solver's answer to what the network says it understood is: what its pointers and waypoints add
            is the difference to `verified`.
        understood: Every criterion is as meant.
        consistent: The parts of the network's own answer fit together.
        faithful: The network's own answer does what it says it understood.
        driven_consistent: Of the answers that are driven, how many are consistent and faithful.
        passes: Forward passes, mean, of the answers that are driven.
        latency_ms: Wall time of an answer that is driven, median.
    """

    count: int
    success: float
    verified: float
    solved: float
    understood: float
    consistent: float
    faithful: float
    driven_consistent: float
    passes: float
    latency_ms: float


def figures(engine: ViladEngine, found: Sequence[ViladCase], how: Unmasking, criteria: Sequence[str]) -> ViladFigures:
    """Of the network on commands.

    Args:
        engine: The network.
        found: The commands.
        how: How it is unmasked.
        criteria: Slots that say what was understood.
    """
    alone: list[Judged] = []
    driven: list[Judged] = []
    read: list[bool] = []
    passes: list[int] = []
    seconds: list[float] = []
    for one in found:
        begun = time.perf_counter()
        scene = one.features()
        predict = engine.predict(one.text, scene)
        raw = unmask(predict, one.template.canvas, one.template.allowed(len(scene)), how)
        decided = one.verified(predict, raw)
        seconds.append(time.perf_counter() - begun)
        passes.append(decided.passes)
        said = one.template.decode(raw.row)
        read.append(one.solved({name: str(said[name]) for name in criteria}))
        alone.append(one.judged(said))
        driven.append(one.judged(one.template.decode(decided.row)))
    return ViladFigures(
        len(found),
        _share([one.success for one in alone]),
        _share([one.success for one in driven]),
        _share(read),
        _share([one.understood for one in alone]),
        _share([one.consistent for one in alone]),
        _share([one.faithful for one in alone]),
        _share([one.consistent and one.faithful for one in driven]),
        float(np.mean(passes)),
        1000.0 * float(np.median(seconds)),
    )


def _share(found: Sequence[bool]) -> float:
    return 100.0 * sum(found) / len(found)


def solved(read: Callable[[str], Mapping[str, str]], found: Sequence[ViladCase]) -> tuple[float, float]:
    """(success, understood) of a reader with the exact solver behind it, percent."""
    asked = [read(one.text) for one in found]
    return (
        _share([one.solved(own) for one, own in zip(found, asked, strict=True)]),
        _share([dict(own) == dict(one.asked) for one, own in zip(found, asked, strict=True)]),
    )
