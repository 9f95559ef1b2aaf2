"""Fixtures of the program tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from straight_road import StraightRoad

from chauffeur.programs import UNHURRIED, ProgramExecutor, Sandbox


@pytest.fixture
def road() -> StraightRoad:
    """A fresh straight road."""
    return StraightRoad()


@pytest.fixture(scope="session")
def sandbox() -> Iterator[Sandbox]:
    """One unhurried sandbox for all tests of meaning."""
    with Sandbox(UNHURRIED) as shared:
        yield shared


@pytest.fixture
def executor(sandbox: Sandbox) -> Iterator[ProgramExecutor]:
    """An executor on the shared sandbox."""
    with ProgramExecutor(sandbox=sandbox) as fresh:
        yield fresh
