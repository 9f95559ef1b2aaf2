"""The registry of executors: each kind of policy has one, built in or of the entry points `chauffeur.executors`."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Final, Protocol

from chauffeur.concept import ScenarioError
from chauffeur.concept.registry import load_plugin, plugin_names
from chauffeur.executors.base import Executor
from chauffeur.safety.format import EXECUTORS
from chauffeur.worlds.base import World

MakeExecutor = Callable[[World], Executor]

BUILT_IN: Final = {
    "program": "program:ProgramDrive",
    "parameters": "parameters:parameters_executor",
    "action_matrix": "action_matrix:ActionMatrixExecutor",
    "trajectory": "trajectory:TrajectoryExecutor",
}
"""Imported late: a control process loads the solver of action matrices only where it drives one."""


class OfKind(Protocol):
    """A policy of any kind: the paper's four, or a third party's."""

    @property
    def kind(self) -> str: ...


def executor_for(policy: OfKind, world: World) -> Executor:
    """Make the executor of this kind of policy in a world, just reset. Third parties' judge their policies, too, by
    `fault` (`safety.format`).

    Raises:
        ScenarioError: The kind has none.
    """
    if policy.kind in BUILT_IN:
        module, name = BUILT_IN[policy.kind].split(":")
        return getattr(import_module(f"chauffeur.executors.{module}"), name)(world)
    known = plugin_names(EXECUTORS)
    if policy.kind not in known:
        raise ScenarioError(
            f"A policy of the kind {policy.kind!r} has no executor.",
            hint=f"Known: {', '.join((*BUILT_IN, *known))}.",
        )
    return load_plugin(EXECUTORS, policy.kind)(world)
