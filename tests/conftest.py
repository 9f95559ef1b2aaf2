"""Shared fixtures. Third-party data is read where it lies; tests that need it skip, and say why, where it is absent."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

SHARED_DATA = Path(os.environ.get("CHAUFFEUR_TEST_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))


@pytest.fixture(scope="session")
def lampilot_data() -> Path:
    """Folder with `DbLv1-dev` and the peer's own outcomes."""
    folder = SHARED_DATA / "lampilot"
    if not (folder / "DbLv1-dev").is_dir():
        pytest.skip(f"LaMPilot data not found at {folder}; set CHAUFFEUR_TEST_DATA to the folder that holds lampilot/")
    return folder


@pytest.fixture(autouse=True)
def _private_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No test touches the user's profiles or cache."""
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path / "home"))
