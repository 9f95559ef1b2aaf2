"""Fixtures of the tests of drives."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from chauffeur.programs import UNHURRIED, Sandbox


@pytest.fixture(scope="session")
def sandbox() -> Iterator[Sandbox]:
    """One unhurried sandbox for every test in which its budget is not what is tested."""
    with Sandbox(UNHURRIED) as shared:
        yield shared
