"""`chauffeur show unmasking`: how the ViLaD planner decides, as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def unmasking(
    wish: Annotated[str, typer.Argument(help="Where you want to park or to drive, in your own words.")],
    scenario: Annotated[
        str, typer.Option(help="A parking lot or an open road; see `chauffeur show scenarios`.")
    ] = "parking-lift",
    out: Annotated[Path, typer.Option(help="File to write.")] = Path("unmasking.svg"),
    tau: Annotated[float, typer.Option(help="Confidence above which a decision is kept at once.")] = 0.9,
    steps: Annotated[int, typer.Option(min=1, help="Most passes.")] = 13,
) -> None:
    """Write how a decision forms, pass by pass."""
    from chauffeur.cli.console import stdout
    from chauffeur.concept import ScenarioError
    from chauffeur.describe.dispatch import describe
    from chauffeur.driving.episode import make_world
    from chauffeur.driving.scenarios import find
    from chauffeur.hmi.unmasking_svg import unmasking_svg
    from chauffeur.planners.vilad import driving, parking
    from chauffeur.planners.vilad.engine import SHIPPED_DRIVE, shipped
    from chauffeur.planners.vilad.unmasking import Unmasking
    from chauffeur.planners.vilad.unmasking import unmasking as decide

    place = find(scenario, None)
    context = describe(make_world(place).reset(place))
    if context.lot is not None:
        spots, free = parking.free_spots(context.lot)
        engine, template, features, names = shipped(), parking.TEMPLATE, spots.features(), ("none", *free)
    elif context.street is not None:
        engine, template, features = shipped(SHIPPED_DRIVE), driving.TEMPLATE, driving.features(context.street)
        names = ("none", *(way.turn for way in context.street.ways), *(one.kind for one in context.street.marks))
    else:
        raise ScenarioError(f"{scenario!r} is no parking lot and no street.", hint="Try --scenario parking-lift.")
    predict = engine.predict(wish, features)
    found = list(decide(predict, template.canvas, template.allowed(len(features)), Unmasking(steps=steps, tau=tau)))
    out.write_text(unmasking_svg(template, found, wish, names), encoding="utf-8")
    stdout().print(f"{out}: {len(found)} passes; {template.text(found[-1].row)}", soft_wrap=True, markup=False)
