"""A benchmark of questions, and a model that answers them: no world, no program, nothing is driven.

    [project.entry-points."chauffeur.benchmarks"]
    right-of-way = "right_of_way:RightOfWay"
    [project.entry-points."chauffeur.planners"]
    polite = "right_of_way:Polite"

With these in a package of yours, `chauffeur bench right-of-way --planner polite` asks it.
"""

from dataclasses import dataclass

from chauffeur.bench.kernel.metrics import TableSpec, share
from chauffeur.concept import Usage
from chauffeur.planners.base import Prose

ASK = "Answer with the letter of the right option, nothing else."
RIGHT = share("right-of-way-right-v1", "right", lambda row: row["right"])


@dataclass(frozen=True)
class Question:
    id: str
    topic: str
    text: str
    options: tuple[str, ...]
    right: str


QUESTIONS = (
    Question("q1", "signs", "You reach a stop sign; the crossing is empty.", ("Roll through", "Stop, then go"), "B"),
    Question("q2", "lights", "The light ahead turns yellow 80 m before you.", ("Speed up", "Come to a stop"), "B"),
    Question("q3", "people", "A child stands at the zebra crossing.", ("Let it cross", "Drive on"), "A"),
)


@dataclass(frozen=True)
class Answered:
    topic: str
    right: bool


class RightOfWay:
    id = "right-of-way-v1"
    asks = "words"
    row = Answered
    config = {"questions": len(QUESTIONS)}
    tables = (TableSpec("Right answers", (RIGHT,), "topic"),)

    def items(self):
        return QUESTIONS

    async def request(self, item, desk):
        options = "\n".join(f"{letter}) {option}" for letter, option in zip("ABCD", item.options, strict=False))
        return [{"role": "system", "content": ASK}, {"role": "user", "content": f"{item.text}\n{options}"}]

    def job(self, item, answer):
        return None  # the answer is the result

    def rows(self, outcome):
        if outcome.answer is None:
            return ()
        said = outcome.answer["text"].strip()[:1].upper()
        return (Answered(outcome.item.topic, said == outcome.item.right),)


class Polite:
    """Lets everybody go first."""

    id, model = "polite", "polite-v1"

    @classmethod
    def from_spec(cls, argument):
        return cls()

    async def write(self, messages):
        options = messages[-1]["content"].splitlines()[1:]
        kind = next((line for line in options if line[3:].startswith(("Let", "Stop", "Come"))), options[0])
        return Prose(kind[0], whole=True, model=self.model, usage=Usage())
