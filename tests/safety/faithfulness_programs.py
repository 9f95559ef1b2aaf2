"""Programs and a road for the tests of explanations."""

from __future__ import annotations

from chauffeur.safety.faithfulness import Facts, FactSurroundings, read_facts

HIGHWAY = FactSurroundings(speed_mps=25.0, limit_mps=31.0, gap_m=40.0, other_mps=22.0)


def facts(body: str, before: str = "", library: str = "") -> Facts:
    """Facts of a program whose lines begin at line 3, or that many later as there are `before`."""
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    return read_facts(f"{before}def drive():\n    ego = get_ego_vehicle()\n{lines}    yield autopilot()\n", library)
