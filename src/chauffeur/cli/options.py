"""Options and arguments that several commands take, each declared once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ASKING = "Asking"
"""Panel of the help for what concerns the asked model."""
WHERE = "Where it runs (changes no row)"
"""Panel of the help for what concerns processes and machines."""

AuditFile = Annotated[Path | None, typer.Option(metavar="FILE", help="Audit log to write; see `chauffeur audit`.")]
BaseUrl = Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.")]
BenchOptions = Annotated[
    list[str] | None, typer.Option("--option", "-o", help="An option of the benchmark, NAME=VALUE; may come again.")
]
Concurrency = Annotated[
    int,
    typer.Option(
        min=1,
        envvar="CHAUFFEUR_CONCURRENCY",
        help="Calls in flight at most, fewer while refused; 1 for a server of one slot.",
        rich_help_panel=ASKING,
    ),
]
MaxRequests = Annotated[int | None, typer.Option(min=0, help="Budget of the run in requests.", rich_help_panel=ASKING)]
MaxUsd = Annotated[float | None, typer.Option(min=0.0, help="Budget of the run in USD.", rich_help_panel=ASKING)]
Price = Annotated[
    str | None, typer.Option(help="USD per million tokens, IN/OUT, where it is not known.", rich_help_panel=ASKING)
]
Processes = Annotated[int | None, typer.Option(min=1, help="Processes; default one per core.")]
RayCluster = Annotated[
    str | None,
    typer.Option(help="Work on a Ray cluster: `local`, `auto`, `ray://...` or host:port.", rich_help_panel=WHERE),
]
RunFolder = Annotated[Path, typer.Option(help="Folder of the run; one begun there is continued.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of everything.")]
ShardPart = Annotated[
    str | None,
    typer.Option(
        help="Only part i of n: `3/8`, `auto` in a Slurm array, `auto/8` in an indexed job; without it, what shards "
        "have done is taken over.",
        rich_help_panel=WHERE,
    ),
]
WeightsSeed = Annotated[int, typer.Option(min=0, help="Seed of weights and batches.")]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Worker processes; default one per core.", rich_help_panel=WHERE)
]
Wishes = Annotated[list[str] | None, typer.Argument(metavar="WISH", help="What you want, one after the other.")]
