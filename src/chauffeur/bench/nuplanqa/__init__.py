"""NuPlanQA (paper Sec. IV-C): what a vision-language model sees and understands of a road, in four-way questions."""

from chauffeur.bench.nuplanqa.benchmark import NuPlanQaBenchmark

__all__ = ["NuPlanQaBenchmark"]
