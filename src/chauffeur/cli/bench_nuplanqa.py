"""`chauffeur bench nuplanqa`: what a vision-language model sees and understands of a road (paper Tab. VI)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import ASKING, MaxRequests, MaxUsd, Price

EXAMPLES = help_text("bench_nuplanqa")


def nuplanqa(
    data: Annotated[Path, typer.Option(help="File of questions, or a folder with `questions.json`.")],
    planner: Annotated[str, typer.Option(help="The model: openai/NAME, transformers/FOLDER, bev-llm, bev-llm/FOLDER.")],
    images: Annotated[
        Path | None, typer.Option(help="Folder below which the metadata's paths lie; default beside the questions.")
    ] = None,
    metadata: Annotated[Path | None, typer.Option(help="Metadata, JSON or NuPlanQA's pickle.")] = None,
    control: Annotated[str, typer.Option(help="`pictures`, `blank` (grey ones) or `text` (none).")] = "pictures",
    single_frame: Annotated[
        bool, typer.Option("--single-frame", help="Show one instant in place of the last 1.5 s.")
    ] = False,
    cameras: Annotated[str | None, typer.Option(help="Cameras, separated by commas; default NuPlanQA's six.")] = None,
    shifts: Annotated[
        str, typer.Option(help="Places the options are moved on; `all` asks each question 4 times.")
    ] = "0",
    side: Annotated[int, typer.Option(min=0, help="Longer side of the pictures in px; 0 as they are.")] = 448,
    limit: Annotated[
        int, typer.Option(min=0, help="Only the first so many questions; 0 for all.", rich_help_panel=ASKING)
    ] = 0,
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/nuplanqa-PLANNER.")] = None,
    base_url: Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.", rich_help_panel=ASKING)] = None,
    concurrency: Annotated[int, typer.Option(min=1, help="Calls in flight at most.", rich_help_panel=ASKING)] = 8,
    max_usd: MaxUsd = None,
    max_requests: MaxRequests = None,
    price: Price = None,
) -> None:
    """Nine subtasks in four-way questions about pictures of a road, beside a baseline that sees none of them."""
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.bench.nuplanqa import NuPlanQaBenchmark
    from chauffeur.bench.nuplanqa.frames import CAMERAS
    from chauffeur.cli.bench_run import carry_out, effort, finish, planner_options, show_tables
    from chauffeur.cli.console import plain, stdout
    from chauffeur.planners.registry import make_answerer

    console = stdout()
    frames: Literal["single", "multi"] = "single" if single_frame else "multi"
    bench = NuPlanQaBenchmark(
        str(data), str(images or ""), str(metadata or ""), control, frames, cameras or ",".join(CAMERAS), shifts, side,
        limit,
    )  # fmt: skip
    for what in bench.unreadable:
        console.print(plain(f"Left out: {what}"), soft_wrap=True)
    if control != "text":
        missing = bench.frames.missing([item.token for item in bench.questions if item.token in bench.frames.metadata])
        if missing:
            console.print(f"{len(missing):,} pictures are not there, the first {missing[0]}.", soft_wrap=True)
    who = make_answerer(planner, **planner_options(planner, base_url))
    name = "-".join(["nuplanqa", planner.replace("/", "-"), *([] if control == "pictures" else [control])])
    run = BenchRun(out or Path("runs") / name, bench, who)
    work = effort(1, concurrency, max_usd, max_requests, price)
    rows = carry_out(console, run, lambda watch: run.run(watch, work), f"NuPlanQA ({bench.id})")
    show_tables(console, tables(bench.tables, rows))
    scenes = {row["scene"] for row in rows}
    if any(scene.startswith("simulated") for scene in scenes):
        console.print("The pictures are rendered and the questions generated: simulated, not nuPlan's.")
    finish(console, run)
