"""Options and arguments that several commands take, each declared once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ASKING = "Asking"
"""Panel of the help for what concerns the asked model."""

AuditFile = Annotated[Path | None, typer.Option(metavar="FILE", help="Audit log to write; see `chauffeur audit`.")]
BaseUrl = Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.")]
BenchOptions = Annotated[
    list[str] | None, typer.Option("--option", "-o", help="An option of the benchmark, NAME=VALUE; may come again.")
]
MaxRequests = Annotated[int | None, typer.Option(min=0, help="Budget of the run in requests.", rich_help_panel=ASKING)]
MaxUsd = Annotated[float | None, typer.Option(min=0.0, help="Budget of the run in USD.", rich_help_panel=ASKING)]
Price = Annotated[
    str | None, typer.Option(help="USD per million tokens, IN/OUT, where it is not known.", rich_help_panel=ASKING)
]
Processes = Annotated[int | None, typer.Option(min=1, help="Processes; default one per core.")]
RunFolder = Annotated[Path, typer.Option(help="Folder of the run; one begun there is continued.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of everything.")]
WeightsSeed = Annotated[int, typer.Option(min=0, help="Seed of weights and batches.")]
Wishes = Annotated[list[str] | None, typer.Argument(metavar="WISH", help="What you want, one after the other.")]
