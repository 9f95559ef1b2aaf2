"""The human-feedback setting: requests whose S offers the repository's programs that are nearest to the wish.

A frozen repository is read once; nothing is learned while a benchmark runs. What a model's program calls of it travels
with the program (`Program.library`), is checked with it, and is part of what decides a rollout.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Final

from chauffeur.concept import ConfigError, Context, Instruction, Limits, PlanRequest, SystemMessage
from chauffeur.driving.planning import screened_request
from chauffeur.memory.policies import PolicyRepository
from chauffeur.memory.policies_entry import PolicyEntry
from chauffeur.planners.prompts import COACHED_PROMPT_VERSION, Helper, build_coached_message
from chauffeur.programs.catalogue import vocabulary_of
from chauffeur.worlds.highway.dblv1 import Item

HUMAN_FEEDBACK: Final = "human-feedback"
"""Name of the setting on the command line and in results."""

RECALLED = 3
"""Programs offered with a wish, as LaMPilot's own agent does."""


def offer(
    repository: PolicyRepository,
    command: str,
    world: str,
    limits: Limits,
    *,
    critique: str = "",
    also: Collection[str] = (),
    k: int = RECALLED,
    chain_of_thought: bool = False,
) -> tuple[SystemMessage, tuple[PolicyEntry, ...]]:
    """S for a wish, and the entries it offers.

    Args:
        repository: Where programs are kept.
        command: The wish.
        world: Kind of road.
        limits: Bounds the model is told of.
        critique: What was said of the last attempt, if there was one.
        also: Names of programs to offer in any case, before the others.
        k: How many programs at most.
        chain_of_thought: Ask for numbered reasoning before the program.
    """
    wanted = [entry for entry in repository.entries if entry.callable_name in also]
    near = [one.entry for one in repository.recall(command, world, k + len(wanted), critique=critique)]
    entries = (*wanted, *(entry for entry in near if entry not in wanted))[: max(k, len(wanted))]
    helpers = [Helper(e.callable_name, e.description, e.command, e.callable_source) for e in entries]
    system = build_coached_message(
        helpers, limits=limits, vocabulary=vocabulary_of(world), chain_of_thought=chain_of_thought
    )
    return system, entries


class PolicyAid:
    """Makes the requests of a run from a frozen repository."""

    def __init__(self, folder: Path, limits: Limits, *, k: int = RECALLED) -> None:
        """Read a repository.

        Raises:
            DataError: There is none, or it cannot be read safely.
        """
        self._repository = PolicyRepository(folder)
        self._limits = limits
        self._k = k

    @property
    def id(self) -> str:
        """Identity of its requests besides item and limits: prompt version, number offered, the frozen programs."""
        return f"{COACHED_PROMPT_VERSION}/{self._k}/{self._repository.digest}"

    @property
    def programs(self) -> int:
        """Number of programs in the repository."""
        return len(self._repository.entries)

    @property
    def digest(self) -> str:
        """Hash of the frozen programs."""
        return self._repository.digest

    @property
    def coached_items(self) -> frozenset[str]:
        """Items that its programs were learned on; a score over them is not held out."""
        return frozenset(entry.item for entry in self._repository.entries)

    @property
    def labels(self) -> tuple[str, ...]:
        """Caveats to show with every result of these requests."""
        digest = self._repository.digest[:12]
        learned = f"learned on {len(self.coached_items)} items, which are not held out where they are scored"
        return (f"policy repository {digest}: {self.programs} programs, {learned}", *self._repository.labels)

    async def request(self, item: Item, context: Context) -> PlanRequest:
        """What the planner is given for an item."""
        system, _ = offer(self._repository, item.command, context.situation.world, self._limits, k=self._k)
        return screened_request(Instruction(item.command, source="benchmark"), context, system, limits=self._limits)


def aid_for(setting: str, repository: Path | None, limits: Limits) -> PolicyAid | None:
    """Requests of the human-feedback setting; None for the others, which need no repository.

    Raises:
        ConfigError: The setting needs a repository and has none, or has one and does not use it.
        DataError: The repository cannot be read.
    """
    if setting == HUMAN_FEEDBACK:
        if repository is None:
            raise ConfigError(
                "The setting human-feedback needs a policy repository.",
                hint="Give --repository FOLDER; `chauffeur bench coach` makes one.",
            )
        return PolicyAid(repository, limits)
    if repository is not None:
        raise ConfigError(
            f"The setting {setting} uses no policy repository.", hint="Add --setting human-feedback, or leave it out."
        )
    return None
