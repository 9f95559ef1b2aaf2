"""`chauffeur vehicle egodriver`: a planner behind the gRPC contract by which AlpaSim asks for the ego's way."""

from __future__ import annotations

from typing import Annotated, Final, Literal

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import BaseUrl

EXAMPLES: Final = help_text("egodriver")


def egodriver(
    wish: Annotated[str, typer.Argument(help="What the passenger wants.")] = "Follow the road at the speed limit.",
    planner: Annotated[
        str, typer.Option(help="Who plans: `onboard`, `vlm`, `vilad`, `openai/<model>`, `waypoints/<model>`, ...")
    ] = "onboard",
    base_url: BaseUrl = None,
    runtime: Annotated[
        Literal["alpasim", "carla"], typer.Option(help="Who asks: AlpaSim, or CARLA by autoware_carla_scenario.")
    ] = "alpasim",
    listen: Annotated[str, typer.Option(metavar="HOST:PORT", help="Where to listen.")] = "127.0.0.1:50051",
    speed_limit: Annotated[
        float, typer.Option(min=5.0, max=130.0, help="Speed limit where none is told, km/h.")
    ] = 50.0,
) -> None:
    """Serve a planner to a driving simulator that asks `egodriver.EgodriverService` for the next seconds of the way."""
    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.parts import planner_named
    from chauffeur.concept import ConfigError, MissingExtraError, PersonId
    from chauffeur.concept.units import MPS_PER_KMH
    from chauffeur.driving.session import parse_wish

    try:
        from carla_driver_interface.server import run_server

        from chauffeur.driving.egodriver import EgoDriver
    except ImportError as error:
        raise MissingExtraError("Serving a simulator needs gRPC.", extra="egodriver") from error
    host, _, port = listen.rpartition(":")
    if not host or not port.isdecimal() or int(port) > 65535:
        raise ConfigError(f"{listen!r} is no place to listen at.", hint="Write HOST:PORT, e.g. 127.0.0.1:50051.")
    mind = planner_named(planner, base_url)
    driver = EgoDriver(mind, parse_wish(wish, PersonId("")).text, limit_mps=speed_limit * MPS_PER_KMH)
    stdout().print(plain(f"{mind.id} drives on {listen} for {runtime}; Ctrl-C ends."))
    try:
        run_server(driver, port=int(port), host=host, mode=runtime)
    except RuntimeError as error:
        raise ConfigError(f"Cannot listen on {listen}: {error}.", hint="Choose another with --listen.") from error
