"""A town from above: lanes by kind, lights, signs, crossings, streets and landmarks with their names, as SVG or PNG."""

from __future__ import annotations

import html
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from chauffeur.hmi.road import Bounds, draw_road
from chauffeur.hmi.stills import LOOKS, Canvas, DrawnShape, road_shapes, style_of_looks, svg_of
from chauffeur.hmi.view import as_picture

if TYPE_CHECKING:
    from PIL.Image import Image

    from chauffeur.worlds.town.pack import MapPack

_MARGIN_M: Final = 15.0
_LABEL_M: Final = 40.0
_LETTERS_M: Final = 5.0
_STREET_M: Final = 2.6
"""Letters that fit in a lane."""


def map_svg(pack: MapPack) -> str:
    """The town as an SVG document, a user unit a metre, north up."""
    box = _bounds(pack)
    return "\n".join(
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box.x0:.1f} {box.y0:.1f} '
            f'{box.x1 - box.x0:.1f} {box.y1 - box.y0:.1f}">',
            f"<title>{html.escape(pack.name)}</title>{style_of_looks()}",
            f'<rect x="{box.x0:.1f}" y="{box.y0:.1f}" width="100%" height="100%" fill="{LOOKS["ground"]}"/>',
            svg_of(_shapes(pack, box)),
            "</svg>",
            "",
        )
    )


def map_picture(pack: MapPack, pixels: int = 1600) -> Image:
    """The town as a picture, its longer side so many pixels, north up."""
    from PIL import Image

    box = _bounds(pack)
    wide, tall = box.x1 - box.x0, box.y1 - box.y0
    scale = 2.0 * pixels / max(wide, tall)
    canvas = Canvas(round(wide * scale), round(tall * scale), scale, ((box.x0 + box.x1) / 2.0, (box.y0 + box.y1) / 2.0))
    canvas.paint(_shapes(pack, box))
    return canvas.image.resize((canvas.image.width // 2, canvas.image.height // 2), Image.Resampling.LANCZOS)


def _bounds(pack: MapPack) -> Bounds:
    """Of lanes and places in the frame of pictures, with room for names to the right."""
    xs, ys = zip(*(point for lane in pack.road.lanes for point in lane.centre.points_m), strict=True)
    xs, ys = (*xs, *(place.x_m for place in pack.places)), (*ys, *(place.y_m for place in pack.places))
    labels = _LABEL_M if pack.places else 0.0
    return Bounds(min(xs) - _MARGIN_M, -max(ys) - _MARGIN_M, max(xs) + _MARGIN_M + labels, -min(ys) + _MARGIN_M)


def _shapes(pack: MapPack, box: Bounds) -> Iterator[DrawnShape]:
    """Bottom to top."""
    road, signs = as_picture(pack.road, pack.signs)
    painted = draw_road(road, (), box, signs)
    yield from road_shapes(painted)
    for group in pack.signals:
        for head in group.heads:
            yield DrawnShape("line", "light", tuple((x, -y) for x, y in head.stop_line_m), 0.9)
    for name in painted.names:
        turn = math.remainder(name.heading_rad, math.pi)  # never upside down
        yield DrawnShape("text", "name", ((name.x_m, name.y_m),), _STREET_M, name.text, turn)
    for place in pack.places:
        yield DrawnShape("dot", "place", ((place.x_m, -place.y_m),), 2.5)
        yield DrawnShape("text", "place", ((place.x_m + 4.0, -place.y_m),), _LETTERS_M, place.name, start=True)
