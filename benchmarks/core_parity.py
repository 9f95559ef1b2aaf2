"""The compiled core against highway-env: every development sample under three ego policies, to the end of the episode.

    python benchmarks/core_parity.py --data DIR [--every N]

DIR holds DbLv1 task files, or is the folder that holds DbLv1-dev. After every step the positions, headings, speeds and
crash flags of all vehicles and objects are compared, to 1e-9 and to the last bit; where the sample's goal is decided
(or the episode ends), its ruling, the collision flag and the scores. The world is driven on after the goal is decided,
for at most `--seconds`, so that pile-ups are seen as well.

NumPy's AVX-512 versions of tan, arcsin and power differ from the C library's in the last bit, and where wrecks touch,
the last bit decides: so this runs itself again with those switched off. `--as-is` leaves them on.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

SWITCH = "NPY_DISABLE_CPU_FEATURES"
WITHOUT = "X86_V4 AVX512_ICL"


def main() -> None:
    """Compare, print a table, and end with 1 if any two parted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of DbLv1 task files")
    parser.add_argument("--every", type=int, default=1, help="only every n-th sample")
    parser.add_argument("--seconds", type=float, default=60.0, help="longest simulated episode")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    parser.add_argument("--as-is", action="store_true", help="leave NumPy's vector functions on")
    chosen = parser.parse_args()
    if SWITCH not in os.environ and not chosen.as_is:  # before NumPy is imported
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, SWITCH: WITHOUT})
    import numpy as np

    from chauffeur.bench.kernel.report import markdown
    from parity_episode import POLICIES, TOLERANCE, Episode, compare
    from speed.scenes import load_samples

    samples = load_samples(chosen.data)[:: chosen.every]
    most = round(chosen.seconds * 10)
    jobs = [(sample.scenario, policy, most) for sample in samples for policy in POLICIES]
    begun = time.perf_counter()
    found: dict[str, list[Episode]] = {policy: [] for policy in POLICIES}
    with ProcessPoolExecutor(chosen.jobs) as pool:
        for (_, policy, _), episode in zip(jobs, pool.map(compare, jobs), strict=True):
            found[policy].append(episode)
            if episode.fault:
                print(f"{episode.name}: {episode.fault}", flush=True)
    lines = []
    for policy, episodes in found.items():
        count = Counter(what for e in episodes for what in ("exact", "judged", "crashed") if getattr(e, what))
        agree = sum(not e.fault for e in episodes)
        steps = sum(e.steps for e in episodes)
        numbers = (len(episodes), steps, agree, count["judged"], count["exact"], count["crashed"])
        lines.append([policy, *(f"{number:,}" for number in numbers), f"{max(e.worst for e in episodes):.1e}"])
    header = (
        "Policy",
        "episodes",
        "steps",
        f"states agree to {TOLERANCE:.0e}",
        "judged alike",
        "equal to the last bit",
    )
    print(markdown((*header, "with a crash", "worst difference (m, rad, m/s)"), lines))
    switched = os.environ.get(SWITCH, "nothing")
    print(f"NumPy {np.__version__} without: {switched}. {time.perf_counter() - begun:.0f} s wall.")
    sys.exit(any(e.fault for episodes in found.values() for e in episodes))


if __name__ == "__main__":
    main()
