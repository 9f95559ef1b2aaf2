"""Splitting a run over machines that know nothing of each other: shard i of n has the items whose hash falls to it.

Use more shards than machines and let the scheduler hand them out: the hash shuffles, so shards cost about the same, and
a machine that is done takes the next one.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from chauffeur.concept import ConfigError

_FORM = re.compile(r"(\d{1,9})/(\d{1,9})")
_AUTO = re.compile(r"auto(?:/(\d{1,9}))?")
_HINT = "Write --shard 3/8 (the third of eight), or --shard auto in a Slurm array, --shard auto/8 in an indexed job."


@dataclass(frozen=True, slots=True)
class Shard:
    """Part `number` (from 1) of `count`."""

    number: int = 1
    count: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise ConfigError(f"There is no shard {self.number}/{self.count}.", hint=_HINT)

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    def owns(self, item: str) -> bool:
        """True if the item with this id is this shard's."""
        digest = hashlib.sha256(item.encode("utf-8", "surrogatepass")).digest()
        return int.from_bytes(digest[:8], "big") % self.count == self.number - 1

    @property
    def folder(self) -> str:
        """Name of its folder in the run's folder; they sort by number."""
        width = len(str(self.count))
        return f"shard-{self.number:0{width}d}-of-{self.count}"

    @classmethod
    def parse(cls, text: str, environ: Mapping[str, str]) -> Self:
        """A shard from `i/n` (i from 1), or from what the scheduler says.

        `auto` reads Slurm's array (`SLURM_ARRAY_TASK_ID`, `_COUNT`, `_MIN`, `_STEP`); `auto/n` takes the index of a
        Kubernetes indexed job (`JOB_COMPLETION_INDEX`, from 0), which does not say how many there are.

        Raises:
            ConfigError: Not of this form, out of range, or the scheduler does not say.
        """
        given = _FORM.fullmatch(text.strip())
        if given is not None:
            return cls(int(given[1]), int(given[2]))
        auto = _AUTO.fullmatch(text.strip())
        if auto is None:
            raise ConfigError(f"{text!r} names no shard.", hint=_HINT)
        count = int(auto[1]) if auto[1] else None
        if "SLURM_ARRAY_TASK_ID" in environ:
            index = _number(environ, "SLURM_ARRAY_TASK_ID") - _number(environ, "SLURM_ARRAY_TASK_MIN", 0)
            index //= max(1, _number(environ, "SLURM_ARRAY_TASK_STEP", 1))
            return cls(index + 1, count or _number(environ, "SLURM_ARRAY_TASK_COUNT"))
        if "JOB_COMPLETION_INDEX" in environ and count is not None:
            return cls(_number(environ, "JOB_COMPLETION_INDEX") + 1, count)
        missing = "how many shards there are" if "JOB_COMPLETION_INDEX" in environ else "which shard this is"
        raise ConfigError(f"The environment does not say {missing}.", hint=_HINT)


def _number(environ: Mapping[str, str], name: str, default: int | None = None) -> int:
    value = environ.get(name, "")
    if not value and default is not None:
        return default
    try:
        return int(value)
    except ValueError:
        raise ConfigError(f"{name} is {value!r}, not a number.", hint=_HINT) from None


WHOLE = Shard()
"""Everything in one run."""
