"""Make the pictures of docs/images: every one comes from this file, from drives made here.

    python docs/pictures.py                 # all of them, some minutes on two cores
    python docs/pictures.py overtake cabin  # some of them

`vilad-speed` measures for an hour. Drives and decisions repeat bit for bit; the cabin's session runs in real time, so
that picture differs from one run to the next. `trip`, `viewer` and `cabin` need chromium.
"""

from __future__ import annotations

import argparse
import asyncio
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
OVERTAKE = "Overtake the car in front of you."


def overtake() -> None:
    """The moving picture of the README: a recorded drive, read back from its file."""
    import chauffeur
    from chauffeur.driving.recording import read_trip
    from chauffeur.hmi.filmstrip import write_moving_picture

    with tempfile.TemporaryDirectory() as folder:
        trip = Path(folder) / "trip.mcap"
        chauffeur.drive(OVERTAKE, save=trip)
        write_moving_picture(IMAGES / "overtake.webp", read_trip(trip))


def unmasking() -> None:
    """How ViLaD's decisions form, pass by pass."""
    _chauffeur("show", "unmasking", "Park close to the lift, away from other cars.", "--out", IMAGES / "unmasking.svg")
    wish, out = "Turn left and stop near the crosswalk.", IMAGES / "unmasking-drive.svg"
    _chauffeur("show", "unmasking", wish, "--scenario", "open-road", "--out", out)


def trip() -> None:
    """The page of a drive."""
    with tempfile.TemporaryDirectory() as folder:
        _chauffeur("drive", OVERTAKE, "--quiet", "--save", folder)

        async def look(tab: Tab) -> None:
            await tab.open((Path(folder) / "trip.html").as_uri(), (1280, 800))
            await asyncio.sleep(4.0)  # into the drive
            await tab.picture(IMAGES / "trip.png")

        asyncio.run(_browse(look))


def viewer() -> None:
    """A sample of a run in the viewer, its drive beside it."""
    from chauffeur.bench.viewer.content import Content
    from chauffeur.bench.viewer.server import Viewer
    from chauffeur.bench.viewer.shelf import Shelf

    with tempfile.TemporaryDirectory() as folder:
        suite, run = Path(folder) / "suite", Path(folder) / "lampilot-onboard"
        _chauffeur("bench", "scenes", "generate", "--items", 60, "--out", suite)
        _chauffeur("bench", "lampilot", "--data", suite / "test", "--planner", "onboard", "--out", run)
        content = Content(Shelf([run]))
        (name,) = content.index()["order"]
        served = Viewer(content)

        async def look(tab: Tab) -> None:
            async with served.serving():
                await tab.open(f"{served.url}#/runs/{name}/0", (1280, 800))
                await tab.until("document.querySelector('.drive iframe')")
                await asyncio.sleep(3.0)  # into the drive
                await tab.picture(IMAGES / "viewer.png")

        asyncio.run(_browse(look))


def cabin() -> None:
    """The cabin page while a wish is driven."""
    from cabin_drive import driving

    with driving("overtake", engine="grammar", planner="onboard", speed=1.0) as drive:

        async def look(tab: Tab) -> None:
            await tab.open(drive.url, (1024, 768))
            await tab.until("document.querySelector('input[type=text]')")
            await tab.press("/")
            await tab.type(OVERTAKE)
            await tab.press("Enter")
            await asyncio.to_thread(drive.until, "the wish", lambda: drive.wish(OVERTAKE))
            await asyncio.sleep(3.0)  # beside the other car
            await tab.picture(IMAGES / "cabin.png")

        asyncio.run(_browse(look))


def vilad_speed() -> None:
    """Fig. 17 on this machine."""
    script = ROOT / "benchmarks" / "vilad_speed.py"
    sizes = ["--sizes", "lot", "3M", "10M", "30M", "--repeats", "5"]
    subprocess.run([sys.executable, script, *sizes, "--plot", IMAGES / "vilad-speed.svg"], check=True)


PICTURES: dict[str, tuple[Callable[[], None], tuple[str, ...]]] = {
    "overtake": (overtake, ("overtake.webp",)),
    "trip": (trip, ("trip.png",)),
    "viewer": (viewer, ("viewer.png",)),
    "cabin": (cabin, ("cabin.png",)),
    "unmasking": (unmasking, ("unmasking.svg", "unmasking-drive.svg")),
    "vilad-speed": (vilad_speed, ("vilad-speed.svg",)),
}
"""Who makes which files."""


def _chauffeur(*words: object) -> None:
    subprocess.run([sys.executable, "-m", "chauffeur", *map(str, words)], check=True)


async def _browse(look: Callable[[Tab], object]) -> None:
    with tempfile.TemporaryDirectory() as profile:
        async with browser(Path(profile)) as tab:
            await look(tab)  # type: ignore[misc]


if __name__ == "__main__":
    sys.path += [str(ROOT / "tests"), str(ROOT / "tests" / "hmi" / "cabin")]
    from chromium import Tab, browser

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(PICTURES)}; all without")
    for name in parser.parse_args().names or PICTURES:
        PICTURES[name][0]()
