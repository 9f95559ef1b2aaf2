"""Executors: one module a policy kind. They turn a checked policy into commands; `driving.actuate` hands those on.

That of programs is not named here: a control process drives none, and loads nothing of their language.
"""

from chauffeur.executors.action_matrix import ActionMatrixExecutor
from chauffeur.executors.base import Executor, ExecutorBase, ExecutorStatus
from chauffeur.executors.registry import executor_for
from chauffeur.executors.trajectory import TrajectoryExecutor

__all__ = [
    "ActionMatrixExecutor",
    "Executor",
    "ExecutorBase",
    "ExecutorStatus",
    "TrajectoryExecutor",
    "executor_for",
]
