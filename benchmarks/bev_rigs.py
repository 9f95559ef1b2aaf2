"""What BEV cells are worth where the rigs differ: one network with them and one without, trained and tested alike.

    python benchmarks/bev_rigs.py --data rigs [--scenes 1000] [--steps 1200] [--seed 0]

On a car whose cameras are bolted on, the place of a patch in its picture tells where on the road it is, and nothing is
gained by cells. Here every scene (staged, simulated) is seen by a rig of its own: six cameras in a ring that begins at
a random angle, with random heights and places, in random order; the calibration alone says where a picture looks. The
encoder is the shipped one, frozen; everything behind it is trained from nothing, for as many steps on the same scenes.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch.nn.functional import cross_entropy

from chauffeur.bench.nuplanqa.scenes.making import CONDITIONS
from chauffeur.bench.nuplanqa.scenes.records import made_out, truth_of
from chauffeur.bench.nuplanqa.scenes.staging import stage
from chauffeur.camera import Camera, Rig, make_renderer
from chauffeur.models.bev_llm.facets import cells_of, facets, labels_of
from chauffeur.models.bev_llm.fusion import FusionConfig
from chauffeur.models.bev_llm.geometry import rig_geometry
from chauffeur.models.bev_llm.network import CompactBevLlm, CompactConfig
from chauffeur.models.bev_llm.recipe import SIZE, WEIGHTS, CompactAnswerer

VIEWS = 6
SPATIAL = ("ahead", "beside left", "beside right", "behind", "density", "key")
EGO = ("manoeuvre", "situation", "action")
EMPTY_WEIGHT = 0.15


def ring(rng: np.random.Generator) -> Rig:
    """Six cameras around the car, the first one in any direction."""
    first, cameras = float(rng.uniform(-math.pi, math.pi)), list[Camera]()
    for number in range(VIEWS):
        yaw = math.remainder(first + number * math.tau / VIEWS + float(rng.normal(0.0, 0.1)), math.tau)
        place = (0.6 + 0.9 * math.cos(yaw), 0.5 * math.sin(yaw), float(rng.uniform(1.3, 1.8)))
        cameras.append(Camera.of_view(f"ring{number}", (SIZE[1], SIZE[0]), math.radians(75.0), place, yaw))
    return Rig("ring", tuple(cameras[int(i)] for i in rng.permutation(VIEWS)), -1.46)


def make(path: Path, count: int, seed: int) -> dict[str, np.ndarray]:
    """Pictures, geometry and labels of so many scenes; what is there already is read."""
    if path.is_file():
        with np.load(path) as held:
            return dict(held)
    of, config, renderer = facets(), CompactConfig(1, (2,)), make_renderer()
    rows: dict[str, list[Any]] = {name: [] for name in ("pictures", "rays", "bias", "labels", "cells")}
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        scene, rig = stage(f"{seed:08x}{number:08x}", rng), ring(rng)
        taken = renderer.render(scene.now, rig, CONDITIONS[scene.sky], number, truth=True)
        seen = made_out(taken)
        truth = truth_of(scene, seen, seen, rig)
        geometry = rig_geometry(rig.cameras, config.patches, config.fusion.grid)
        rows["pictures"].append(np.stack([image.pixels().transpose(2, 0, 1) for image in taken.images]))
        rows["rays"].append(geometry.rays)
        rows["bias"].append(geometry.bias.astype(np.float16))
        rows["labels"].append(labels_of(truth, of))
        rows["cells"].append(cells_of(truth, config.fusion.grid))
    renderer.close()
    found = {name: np.stack(values) for name, values in rows.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as out:
        np.savez_compressed(out, allow_pickle=False, **found)
    return found


def network_of(bev: bool, seed: int) -> CompactBevLlm:
    """A fresh network behind the shipped encoder."""
    torch.manual_seed(seed)
    fusion = FusionConfig(64, 2, bev_width=64, bev=bev, history=False)
    network = CompactBevLlm(CompactConfig(20, tuple(len(one) for _, one in facets()), fusion=fusion, views=VIEWS))
    shipped = CompactAnswerer.stored_weights(WEIGHTS)
    network.load_state_dict({k: v for k, v in shipped.items() if k.startswith("views.")}, strict=False)
    return network


def gathered(network: CompactBevLlm, data: dict[str, torch.Tensor], rows: Any) -> tuple[torch.Tensor, Any]:
    """Tokens and cells of some scenes."""
    present = data["features"][rows].float()
    places = torch.from_numpy(network.config.fusion.grid.centres() / 10.0)
    rig = (data["rays"][rows], data["bias"][rows].float(), places)
    return network.gather(present, present[:, None, :0][:, :0], rig, torch.zeros(len(present), 1, 3))


def learn(network: CompactBevLlm, data: dict[str, torch.Tensor], steps: int, seed: int) -> None:
    """Teach everything behind the encoder the ground truth."""
    taught = [value for name, value in network.named_parameters() if not name.startswith(("views.", "decoder."))]
    optimiser = torch.optim.AdamW(taught, lr=2e-3, betas=(0.9, 0.98), weight_decay=0.05)
    weights = torch.ones(network.config.kinds)
    weights[0] = EMPTY_WEIGHT
    network.train()
    for step in range(steps):
        rng = np.random.default_rng([seed, step])
        rows = torch.from_numpy(rng.choice(len(data["labels"]), 32, replace=False))
        tokens, cells = gathered(network, data, rows)
        labels = data["labels"][rows]
        losses = [
            cross_entropy(logits, labels[:, place], ignore_index=-1)
            for place, logits in enumerate(network.classes(tokens))
            if bool((labels[:, place] >= 0).any())
        ]
        loss = torch.stack(losses).mean()
        if cells is not None:
            guessed = network.occupied(cells).flatten(0, 1)
            loss = loss + 0.5 * cross_entropy(guessed, data["cells"][rows].flatten(), weights, ignore_index=-1)
        for group in optimiser.param_groups:
            group["lr"] = 2e-3 * min(1.0, (step + 1) / 60, max(0.02, (steps - step) / (0.6 * steps)))
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(taught, 1.0)
        optimiser.step()


def right(network: CompactBevLlm, data: dict[str, torch.Tensor]) -> dict[str, float]:
    """Share of right classes of each facet, every class counted alike, in percent."""
    network.eval()
    with torch.inference_mode():
        starts = range(0, len(data["labels"]), 64)
        parts = [network.classes(gathered(network, data, slice(at, at + 64))[0]) for at in starts]
    found: dict[str, float] = {}
    for place, (name, classes) in enumerate(facets()):
        guessed, labels = torch.cat([part[place] for part in parts]).argmax(dim=1), data["labels"][:, place]
        shares = [
            float((guessed[labels == one] == one).float().mean())
            for one in range(len(classes))
            if bool((labels == one).any())
        ]
        found[name] = 100.0 * sum(shares) / max(1, len(shares))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=1200)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    splits: dict[str, dict[str, torch.Tensor]] = {}
    encoder = network_of(True, 0).eval()
    for seed, (split, count) in enumerate((("train", arguments.scenes), ("test", arguments.scenes // 4)), 71):
        held = make(arguments.data / f"{split}-{count}.npz", count, seed)
        data = {name: torch.from_numpy(values) for name, values in held.items()}
        with torch.inference_mode():
            pictures = data.pop("pictures").split(32)
            seen = [
                encoder.views(one.flatten(0, 1).float() / 255.0).unflatten(0, (-1, VIEWS)).half() for one in pictures
            ]
        splits[split] = {**data, "features": torch.cat(seen).clone()}
        print(f"{split}: {count} scenes", flush=True)
    table: dict[str, dict[str, float]] = {}
    for bev in (True, False):
        network = network_of(bev, arguments.seed)
        learn(network, splits["train"], arguments.steps, arguments.seed)
        table["with cells" if bev else "without"] = right(network, splits["test"])
        print(f"{'with cells' if bev else 'without'}: learned", flush=True)
    print(f"\n{'facet':16}" + "".join(f"{name:>12}" for name in table))
    for name, _ in facets():
        print(f"{name:16}" + "".join(f"{one[name]:12.1f}" for one in table.values()))
    for group, names in (("spatial", SPATIAL), ("ego-centric", EGO)):
        means = [sum(one[name] for name in names) / len(names) for one in table.values()]
        print(f"{group:16}" + "".join(f"{mean:12.1f}" for mean in means))


if __name__ == "__main__":
    main()
