"""The picture of how a decision forms: whole where no animation runs."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from chauffeur.hmi.unmasking_svg import unmasking_svg
from chauffeur.planners.vilad.parking import TEMPLATE
from chauffeur.planners.vilad.unmasking import Unmasking, unmasking

_SVG = "{http://www.w3.org/2000/svg}"


def test_a_row_a_pass_is_there_without_animation_and_fades_in_with_it() -> None:
    scores = np.random.default_rng(4).normal(0.0, 3.0, (TEMPLATE.length, TEMPLATE.size + 3))
    steps = list(unmasking(lambda _: scores, TEMPLATE.canvas, TEMPLATE.allowed(3), Unmasking(steps=4, tau=0.9)))
    pictures = [
        ElementTree.fromstring(unmasking_svg(TEMPLATE, steps, "Park & go", ("none", "A1", "B2"), animated=animated))
        for animated in (True, False)
    ]
    for picture, many in zip(pictures, (len(steps), 0), strict=True):
        rows = picture.findall(f"{_SVG}g")
        assert len(rows) == len(steps) + 1
        assert not any("opacity" in row.attrib for row in rows)  # print and PNG show every row
        assert len(picture.findall(f"{_SVG}g/{_SVG}animate")) == many
