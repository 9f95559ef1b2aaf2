"""What answers in the compact BEV-LLM: the whole, its decoder switched off, and its decoder alone.

    python benchmarks/bev_decoder.py --out qa      # renders the test split of the card's set (280 scenes) below qa

An option's score is a sum of two parts: how likely the classes that its words mean are in the scene (facet heads and a
bag of words), and what the decoder adds (`fits`). Same weights, same questions; a part is left out at the test alone.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch

from chauffeur.bench.kernel.report import markdown
from chauffeur.bench.nuplanqa.scenes.making import QaConfig, make_split
from chauffeur.models.bev_llm.recipe import WEIGHTS, CompactAnswerer, QaTensors, load_split

SET = QaConfig(scenes=1_400, width=224, height=128, frames=2, front=2)
"""As the model card says; the test split has a fifth as many scenes."""


def parts(answerer: CompactAnswerer, data: QaTensors) -> dict[str, torch.Tensor]:
    """Scores of all options (questions, 4) by what is left of the sum."""
    tokens = answerer.all_tokens(data)
    asked = [
        (row, item.question, item.options, item.speeds_mps)
        for row, found in enumerate(data.questions)
        for item in found
    ]
    fits = answerer.network.fits
    with torch.inference_mode():
        whole = torch.cat([answerer.scores(tokens, asked[at : at + 32]) for at in range(0, len(asked), 32)])
        fits.weight.zero_()
        fits.bias.zero_()
        without = torch.cat([answerer.scores(tokens, asked[at : at + 32]) for at in range(0, len(asked), 32)])
    return {"whole": whole, "decoder off": without, "decoder alone": whole - without}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the set; made, or completed, where it is not"
    )
    given = parser.parse_args()
    if not (given.out / "test" / "truth.json").is_file():
        make_split(given.out, "test", SET, lambda done, of: print(f"\r{done} of {of} scenes", end="", flush=True))
        print()
    data = load_split(given.out / "test")
    answer = torch.tensor([item.answer for item in data.items])
    found = {name: scores.argmax(dim=1) for name, scores in parts(CompactAnswerer.load(WEIGHTS), data).items()}
    cells = [
        (
            name,
            f"{100.0 * (chosen == answer).float().mean():.1f}",
            f"{100.0 * (chosen == found['whole']).float().mean():.1f}",
        )
        for name, chosen in found.items()
    ]
    print(f"{len(answer)} questions on {len(data.truth)} unseen simulated scenes, shipped weights\n")
    print(markdown(("what answers", "right, %", "same choice as the whole, %"), cells))


if __name__ == "__main__":
    main()
