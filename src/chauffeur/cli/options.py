"""Options and arguments that several commands take, each declared once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ASKING = "Asking"
"""Panel of the help for what concerns the asked model."""
WHERE = "Where it runs (changes no row)"
"""Panel of the help for what concerns processes and machines."""

VOICE = "Voice"
"""Panel of the help for what concerns speaking to the car."""

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
DryRun = Annotated[bool, typer.Option("--dry-run", help="Print what would be published; publish nothing.")]
LimitsName = Annotated[str, typer.Option(help="Bounds no plan may cross: `default` or `lampilot`.")]
DrivesOf = Annotated[Path | None, typer.Option(help="DbLv1 folder, to show the drives of runs that kept no scenes.")]
Gallery = Annotated[
    int | None, typer.Option(min=0, help="Items shown of each run; default up to 12, fewer of many runs.")
]
MaxRequests = Annotated[int | None, typer.Option(min=0, help="Budget of the run in requests.", rich_help_panel=ASKING)]
MaxUsd = Annotated[float | None, typer.Option(min=0.0, help="Budget of the run in USD.", rich_help_panel=ASKING)]
Microphone = Annotated[
    bool,
    typer.Option("--microphone/--no-microphone", help="Listen to this machine's microphone.", rich_help_panel=VOICE),
]
MicrophoneDevice = Annotated[
    str, typer.Option("--device", help="Which one: number or part of its name.", rich_help_panel=VOICE)
]
Price = Annotated[
    str | None, typer.Option(help="USD per million tokens, IN/OUT, where it is not known.", rich_help_panel=ASKING)
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print the outcome only.")]
RayCluster = Annotated[
    str | None,
    typer.Option(help="Work on a Ray cluster: `local`, `auto`, `ray://...` or host:port.", rich_help_panel=WHERE),
]
ShardPart = Annotated[
    str | None,
    typer.Option(
        help="Only part i of n: `3/8`, `auto` in a Slurm array, `auto/8` in an indexed job; without it, what shards "
        "have done is taken over.",
        rich_help_panel=WHERE,
    ),
]
Speak = Annotated[bool, typer.Option("--speak", help="Say answers aloud (espeak-ng).", rich_help_panel=VOICE)]
SpeechEngine = Annotated[
    str,
    typer.Option(
        "--engine",
        help="For speech: `grammar`, `whisper/<folder>`, `endpoint/<model>`, or `none`.",
        rich_help_panel=VOICE,
    ),
]
TrafficSeed = Annotated[int | None, typer.Option(min=0, help="Seed of the traffic; default the scenario's own.")]
VehicleFile = Annotated[Path, typer.Argument(metavar="FILE", help="The vehicle's configuration file; see docs/ros.md.")]
VehicleWait = Annotated[float, typer.Option("--wait", min=0.5, max=60.0, help="Seconds to look for the vehicle.")]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Worker processes; default one per core.", rich_help_panel=WHERE)
]
Wishes = Annotated[list[str] | None, typer.Argument(metavar="WISH", help="What you want, one after the other.")]
