# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The ego-status MLP: what a car's own motion and the command tell, learnt, without a picture.

Open-loop planning on plain logs is won by such models (AD-MLP, Zhai et al. 2023; BEV-Planner, Li et al. 2024), so a
figure without this one beside it says nothing. It minimises the very L2 error that is measured.
"""

from __future__ import annotations

from collections import Counter
from copy import deepcopy
from typing import Any, Final

import numpy as np
import torch

from chauffeur.bench.openloop.extrapolation import constant_velocity
from chauffeur.foreign.waypoints import FUTURE
from chauffeur.models.vilad.frames_data import FrameSet
from chauffeur.models.vilad.frames_vision import StatusHead, batches, l2, status
from chauffeur.models.vilad.waypoints import displacements

Array = np.ndarray[Any, Any]

STEPS: Final = 4000
FOLDS: Final = 4
_BATCH: Final = 128
_EVERY: Final = 200


def train_status_mlp(train: FrameSet, val: FrameSet, steps: int = STEPS, seed: int = 0) -> StatusHead:
    """Train it; of all states looked at, the one that is best on the validation split."""
    torch.manual_seed(seed)
    model = StatusHead()
    optimiser = torch.optim.AdamW(model.parameters(), lr=1e-3, weight_decay=0.05)
    said = torch.from_numpy(status(train))
    truth = torch.from_numpy(displacements(train.histories, train.futures)).float()
    val_truth = torch.from_numpy(displacements(val.histories, val.futures)).float()
    val_said = torch.from_numpy(status(val))
    best, kept = float("inf"), deepcopy(model)
    feed = batches(len(said), min(_BATCH, len(said)), seed)(0)
    for step in range(steps):
        for group in optimiser.param_groups:
            group["lr"] = 1e-3 * max(0.02, 1.0 - step / steps)
        _, rows = next(feed)
        optimiser.zero_grad(set_to_none=True)
        l2(model(said[rows]), truth[rows]).backward()
        optimiser.step()
        if (step + 1) % _EVERY == 0 or step + 1 == steps:
            with torch.no_grad():
                now = float(l2(model(val_said), val_truth))
            if now < best:
                best, kept = now, deepcopy(model)
    return kept.eval()


@torch.no_grad()
def told(model: StatusHead, frames: FrameSet) -> Array:
    """Displacements (n, FUTURE, 2) of a set."""
    return model(torch.from_numpy(status(frames))).numpy()


def expected_paths(model: StatusHead, frames: FrameSet) -> Array:
    """Path from own motion and command alone, (n, FUTURE, 2), m, ego frame: what a picture is to correct."""
    return np.stack([constant_velocity(one) for one in frames.histories]) + told(model, frames)


def strangers_paths(frames: FrameSet, steps: int = STEPS, seed: int = 0) -> Array:
    """`expected_paths` of a training split, each by an MLP that was trained without that frame's scene.

    On its own training frames an MLP errs less than it will anywhere else, and who learns to correct it there learns to
    correct too little. The scenes of each place are dealt out to `FOLDS` in turn, so that no MLP has to tell of a kind
    of road that it never met.
    """
    scenes: dict[str, int] = {}
    met: Counter[str] = Counter()
    for name, place in {one.scene: one.place for one in frames.samples}.items():
        scenes[name] = met[place] % FOLDS
        met[place] += 1
    fold = np.array([scenes[one.scene] for one in frames.samples])
    found = np.zeros((len(fold), FUTURE, 2))
    for own in (fold == number for number in np.unique(fold)):
        mine = frames.part(own)
        found[own] = expected_paths(train_status_mlp(frames.part(~own), mine, steps, seed), mine)
    return found
