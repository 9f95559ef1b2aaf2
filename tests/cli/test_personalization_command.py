"""`chauffeur bench personalization` as it is typed."""

from __future__ import annotations

from typer.testing import CliRunner

from chauffeur.cli.main import app


def test_unknown_wordings_are_refused() -> None:
    assert CliRunner().invoke(app, ["bench", "personalization", "--half", "other"]).exit_code == 2
