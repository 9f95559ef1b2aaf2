# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The ego-status MLP: what a car's own motion and the command tell, learnt, without a picture.

Open-loop planning on plain logs is won by such models (AD-MLP, Zhai et al. 2023; BEV-Planner, Li et al. 2024), so a
figure without this one beside it says nothing. It minimises the very L2 error that is measured.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any, Final

import numpy as np
import torch

from chauffeur.models.vilad.frames_data import FrameSet
from chauffeur.models.vilad.frames_vision import StatusHead, batches, l2, status
from chauffeur.models.vilad.waypoints import WaypointCodebook

Array = np.ndarray[Any, Any]

STEPS: Final = 4000
_BATCH: Final = 128
_EVERY: Final = 200


def train_status_mlp(train: FrameSet, val: FrameSet, steps: int = STEPS, seed: int = 0) -> StatusHead:
    """Train it; of all states looked at, the one that is best on the validation split."""
    torch.manual_seed(seed)
    model = StatusHead()
    optimiser = torch.optim.AdamW(model.parameters(), lr=1e-3, weight_decay=0.05)
    said = torch.from_numpy(status(train))
    truth = torch.from_numpy(WaypointCodebook.displacements(train.histories, train.futures)).float()
    val_truth = torch.from_numpy(WaypointCodebook.displacements(val.histories, val.futures)).float()
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
