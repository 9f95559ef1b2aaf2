"""Motion control by gains: three manoeuvres, ten commands each, five kinds of weather (paper Sec. VI-C, Tab. XI)."""

from chauffeur.bench.motion.benchmark import MotionBenchmark

__all__ = ["MotionBenchmark"]
