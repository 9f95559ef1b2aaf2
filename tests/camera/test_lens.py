"""Radial distortion: pictures and points bend alike, and no pixel comes from outside of what was rendered."""

from __future__ import annotations

import numpy as np
import pytest

from chauffeur.camera import LOOKS, front_rig
from chauffeur.camera.lens import Lens


@pytest.mark.parametrize("name", ["held_out_a", "held_out_b"])
def test_pictures_and_points_bend_alike(name):
    lens = Lens.of(front_rig(224, 128).cameras[0], LOOKS[name])
    for u, v in ((112.0, 64.0), (40.0, 30.0), (180.0, 100.0), (150.0, 20.0)):
        picture = np.zeros((128, 224), bool)
        picture[int(v) - 2 : int(v) + 2, int(u) - 2 : int(u) + 2] = True
        rows, columns = np.nonzero(lens.bend(picture))
        expected = lens.points(np.array([[u, v]]))[0]
        assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx(tuple(expected), abs=0.8)


@pytest.mark.parametrize("name", ["held_out_a", "held_out_b"])
def test_no_row_or_column_is_smeared_along_the_rim(name):
    lens = Lens.of(front_rig(224, 128).cameras[0], LOOKS[name])
    v, u = np.mgrid[0:128, 0:224]
    for picture, along in ((u, 1), (v, 0)):
        bent = lens.bend(picture)
        assert (np.diff(bent.astype(int), axis=along) == 0).sum() < 0.35 * bent.size
        rim = bent[:, -4:] if along else bent[-4:]
        assert len(np.unique(rim)) > 3
    assert Lens.of(front_rig().cameras[0], LOOKS["default"]).bend(u) is u
