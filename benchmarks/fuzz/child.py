"""The process that fuzzes one target. `run.py` starts it, again after a crash; what it found lies on the disk by then.

python child.py TARGET FOLDER EXECUTIONS [libFuzzer's options and corpus folders]
"""

from __future__ import annotations

import base64
import hashlib
import json
import random
import sys
import time
import traceback
from collections import Counter
from pathlib import Path
from typing import Final

import atheris

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fuzz.target import Target
from fuzz.targets import target

ROOT: Final = Path(__file__).resolve().parents[2]
OWN_CHANGES: Final = 0.85
"""Share of inputs made by the target's own changes; the others by libFuzzer's."""
SLOW_S: Final = 10.0
"""CPU time of one input, instrumented, beyond which it is a finding."""
_TELL_EVERY_S: Final = 1.0
_MAX_TEXT: Final = 4_000


def modules_besides(reads: tuple[str, ...]) -> list[str]:
    """Modules of Chauffeur that do not guide the fuzzer; some of them, compiled ones, cannot be instrumented."""
    source = ROOT / "src"
    names = (
        ".".join(path.relative_to(source).with_suffix("").parts).removesuffix(".__init__")
        for path in sorted((source / "chauffeur").rglob("*.py"))
    )
    return [name for name in names if not any(name == one or name.startswith(f"{one}.") for one in reads)]


class Child:
    """Counts, keeps findings, and tells both on the disk."""

    def __init__(self, fuzzed: Target, folder: Path, executions: int) -> None:
        self._target = fuzzed
        self._folder = folder
        self._wanted = executions
        self._executions = 0
        self._outcomes: Counter[str] = Counter()
        self._findings: dict[str, dict[str, object]] = {}
        self._told_s = 0.0

    def one(self, data: bytes) -> None:
        """Examine one input; nothing it raises ends the process."""
        before = time.process_time()
        try:
            outcome = self._target.examine(data)
        except Exception as error:  # noqa: BLE001 - whatever is raised is a finding
            self._keep(data, error)
            outcome = "FINDING"
        if time.process_time() - before > SLOW_S:
            self._keep(data, TimeoutError("an input takes too long"))
        self._outcomes[outcome] += 1
        self._executions += 1
        if self._executions >= self._wanted or time.monotonic() - self._told_s > _TELL_EVERY_S:
            self._tell()

    def changed(self, data: bytes, max_size: int, seed: int) -> bytes:
        """A new input from one of the corpus."""
        rng = random.Random(seed)
        if rng.random() < OWN_CHANGES:
            return self._target.changed(data, rng)[:max_size]
        return atheris.Mutate(data, max_size)

    def _keep(self, data: bytes, error: Exception) -> None:
        frames = traceback.extract_tb(error.__traceback__)
        places = [f"{Path(frame.filename).name}:{frame.name}" for frame in frames[-3:]]
        name = hashlib.sha256(repr((type(error).__name__, str(error)[:60], places)).encode()).hexdigest()[:12]
        known = self._findings.get(name)
        if known is None:
            known = self._findings[name] = {
                "error": type(error).__name__,
                "says": str(error)[:_MAX_TEXT],
                "where": places,
                "trace": traceback.format_exception(error)[-6:],
                "times": 0,
                "input": "",
                "shown": "",
            }
        known["times"] = int(str(known["times"])) + 1
        if not known["input"] or len(data) < len(base64.b64decode(str(known["input"]))):
            known["input"] = base64.b64encode(data).decode()
            known["shown"] = repr(data[:_MAX_TEXT])[2:-1]
        (self._folder / "findings").mkdir(exist_ok=True)
        (self._folder / "findings" / f"{name}.json").write_text(json.dumps(known, indent=1), encoding="utf-8")

    def _tell(self) -> None:
        self._told_s = time.monotonic()
        state = {"executions": self._executions, "outcomes": dict(self._outcomes), "findings": sorted(self._findings)}
        draft = self._folder / "state.draft"
        draft.write_text(json.dumps(state), encoding="utf-8")
        draft.replace(self._folder / "state.json")


def main() -> None:
    """Fuzz until the executions are made."""
    name, folder, executions = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    reads = json.loads(sys.argv[4])
    with atheris.instrument_imports(
        include=["chauffeur"], exclude=modules_besides(tuple(reads)), enable_loader_override=False
    ):
        fuzzed = target(name)
    fuzzed.seeds()
    child = Child(fuzzed, folder, executions)
    atheris.Setup([sys.argv[0], *sys.argv[5:]], child.one, custom_mutator=child.changed)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
