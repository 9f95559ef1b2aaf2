"""Fixtures of the program tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from straight_road import StraightRoad

from chauffeur.programs import Budget, ProgramExecutor, Sandbox

PATIENT = Budget(turn_s=1.0, tick_s=2.0, grace_s=1.0, start_s=5.0)
"""For tests of meaning: a busy machine must not fail them. Tests of the budgets use the defaults."""


@pytest.fixture
def road() -> StraightRoad:
    """A fresh straight road."""
    return StraightRoad()


@pytest.fixture(scope="session")
def sandbox() -> Iterator[Sandbox]:
    """One patient sandbox for all tests of meaning."""
    with Sandbox(PATIENT) as shared:
        yield shared


@pytest.fixture
def executor(sandbox: Sandbox) -> Iterator[ProgramExecutor]:
    """An executor on the shared sandbox."""
    with ProgramExecutor(sandbox=sandbox) as fresh:
        yield fresh
