"""Draw `docs/images/viewer.png`: a sample of a run in the viewer, its drive beside it, in a headless Chromium.

    PYTHONPATH=tests python benchmarks/viewer_picture.py runs/lampilot-onboard left_overtake docs/images/viewer.png

The first sample whose id begins with the given letters is shown.
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
from pathlib import Path

from PIL import Image

from chauffeur.bench.viewer.content import Content
from chauffeur.bench.viewer.server import Viewer
from chauffeur.bench.viewer.shelf import Shelf
from chromium import browser

SIZE = (1280, 800)
PLAYED_S = 3.0
"""How far into the drive the picture is."""
COLOURS = 128


async def draw(run: Path, item: str, picture: Path) -> None:
    content = Content(Shelf([run.resolve()]))
    (name,) = content.index()["order"]
    rows = content.rows(name)["rows"]
    place = next(place for place, row in enumerate(rows) if row["item"].startswith(item))
    viewer = Viewer(content)
    with tempfile.TemporaryDirectory() as profile:
        async with viewer.serving(), browser(Path(profile), "--hide-scrollbars") as tab:
            await tab.open(f"{viewer.url}#/runs/{name}/{place}", SIZE)
            await tab.until("document.querySelector('.drive iframe')")
            await asyncio.sleep(PLAYED_S)
            await tab.picture(picture)
    Image.open(picture).convert("RGB").quantize(COLOURS).save(picture, optimize=True)


if __name__ == "__main__":
    asyncio.run(draw(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])))
