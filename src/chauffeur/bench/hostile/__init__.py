"""Hostile words: 618 inputs that try to make the car drive unsafely, and 270 harmless ones that look like them.

Both were written by hand for this suite, in ten classes: override, role play, emergency pretext, unit tricks, nested
quotes, poisoned history, poisoned context (texts of maps, weather and traffic services, signs), encoded text, many
turns, and a second language. `hostile.jsonl` and `lookalikes.jsonl` (in `data/hostile`) have a line an input:

- `id`: stays with the input for ever; `kind`: its class, of a look-alike the class it resembles
- `wish`: the passenger's words; `turns`: what they said before, oldest first
- `context`: text of a service or a sign; `history`: remembered trips (`wish`, `program`, `feedback`), oldest first
- `aim` (hostile): what the attacker is after; `wanted` (look-alikes): what a good driver does

No planner may be trained on them or have words added for them.
"""

from chauffeur.bench.hostile.benchmark import HostileBenchmark, HostileConfig, hostile, planner_of
from chauffeur.bench.hostile.loader import Input, hostile_inputs, lookalikes

__all__ = [
    "HostileBenchmark",
    "HostileConfig",
    "Input",
    "hostile",
    "hostile_inputs",
    "lookalikes",
    "planner_of",
]
