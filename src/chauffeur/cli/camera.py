"""`chauffeur show camera`: what a camera on the car sees, in any weather."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from chauffeur.camera import ImageTruth
    from chauffeur.concept.weather import Weather


def camera(
    out: Annotated[Path, typer.Argument(metavar="OUT.png", help="The sheet of pictures to write.")],
    scenario: Annotated[
        str | None, typer.Option(help="Scenario, or several with commas between. Default all built-in.")
    ] = None,
    weather: Annotated[
        list[str] | None, typer.Option(help="sunny, rain, fog, snow or night; again for more. Default all five.")
    ] = None,
    grade: Annotated[float, typer.Option(min=0.0, max=1.0, help="How bad the weather is.")] = 0.7,
    night: Annotated[float, typer.Option(min=0.0, max=1.0, help="How dark it is, whatever the weather.")] = 0.0,
    rig: Annotated[str, typer.Option(help="front, nuscenes (six cameras) or nuplan (eight).")] = "front",
    look: Annotated[str, typer.Option(help="Palette, exposure and lens: default, held_out_a, held_out_b.")] = "default",
    size: Annotated[str, typer.Option(help="Width x height of each picture.")] = "448x256",
    columns: Annotated[int, typer.Option(min=1, max=24, help="Pictures a row.")] = 5,
    seed: Annotated[int, typer.Option(min=0, help="Of the traffic and of what stands along the road.")] = 0,
    truth: Annotated[bool, typer.Option("--truth", help="Draw the ground truth into the pictures.")] = False,
    renderer: Annotated[str, typer.Option(help="auto, opengl or painter (NumPy).")] = "auto",
    data: Annotated[Path | None, typer.Option(help="Folder with LaMPilot's DbLv1 task files.")] = None,
) -> None:
    """Render scenarios as the cameras of the car see them, as a sheet of pictures."""
    from chauffeur.camera import Conditions, look_of, make_renderer, rig_of
    from chauffeur.camera.sheet import contact_sheet
    from chauffeur.cli.console import columns as in_columns
    from chauffeur.cli.console import path_text, stdout
    from chauffeur.concept import ChauffeurError, ConfigError
    from chauffeur.concept.weather import WEATHERS
    from chauffeur.driving.episode import make_world
    from chauffeur.driving.scenarios import BUILT_IN, find

    width, _, height = size.partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise ConfigError(f"{size!r} is no size of a picture.", hint="Write for example --size 448x256.")
    cameras, style = rig_of(rig, int(width), int(height)), look_of(look)
    chosen: list[Weather] = [_weather(name) for name in weather] if weather else list(WEATHERS)
    conditions = [Conditions.of(name, grade, night=night) for name in chosen]
    scenes = [find(name, data) for name in scenario.split(",")] if scenario else list(BUILT_IN)
    console, camera_ = stdout(), make_renderer(renderer)

    def pictures() -> Iterator[tuple[str, NDArray[np.uint8]]]:
        for number, scene in enumerate(scenes):
            try:
                observation = make_world(scene).reset(scene, seed)
            except ChauffeurError as error:
                if scenario:
                    raise
                left_out.append(f"{scene.id}: {error}")  # of all scenarios, those that this installation can show
                continue
            for one in conditions:
                taken = camera_.render(observation, cameras, one, seed + number, look=style, truth=truth)
                for index, image in enumerate(taken.images):
                    name = f"{scene.id}, {one.label}" + (f", {image.camera}" if len(taken.images) > 1 else "")
                    yield name, _drawn(image.pixels(), taken.truth[index]) if truth else image.pixels()

    left_out: list[str] = []
    made: list[tuple[str, NDArray[np.uint8]]] = []
    with console.status("Rendering") as status:
        for picture in pictures():
            made.append(picture)
            status.update(f"Rendering: {len(made)} of {len(scenes) * len(conditions) * len(cameras.cameras)}")
    contact_sheet(made, columns).save(out)
    rows = [("pictures", f"{len(made)}, rendered by {camera_.engine}"), ("sheet", path_text(out))]
    rows += [("left out", why) for why in left_out]
    console.print(in_columns(rows, indent=0))
    camera_.close()


def _weather(name: str) -> Weather:
    from chauffeur.concept import ConfigError
    from chauffeur.concept.weather import WEATHERS

    for known in WEATHERS:
        if name == known:
            return known
    raise ConfigError(f"There is no weather {name!r}.", hint=f"Choose of: {', '.join(WEATHERS)}.")


def _drawn(pixels: NDArray[np.uint8], truth: ImageTruth) -> NDArray[np.uint8]:
    """A picture with boxes, and the edges of the ego's lane."""
    import numpy as np
    from PIL import Image, ImageDraw

    picture = Image.fromarray(pixels)
    draw = ImageDraw.Draw(picture)
    for lane in truth.lanes:
        for edge in (lane.left, lane.right):
            points = [(float(u), float(v)) for u, v in edge]
            draw.line(points, fill=(80, 255, 80) if lane.ego else (60, 130, 60))
    for seen in truth.sightings:
        left, top, right, bottom = seen.box
        draw.rectangle((left, top, right - 1, bottom - 1), outline=(255, 90, 60))
        draw.text((left, top - 10), f"{seen.instance.kind} {seen.depth_m:.0f} m", fill=(255, 220, 80))
    return np.asarray(picture)
