"""The scripted expert: one hand-written program a task family, that knows of a sample its goal and nothing else."""

from chauffeur.bench.lampilot.expert.programs import EXPERT, expert_program, variants

__all__ = ["EXPERT", "expert_program", "variants"]
