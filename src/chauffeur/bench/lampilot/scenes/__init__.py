"""Scenes and instructions of our own with LaMPilot-Bench's statistics (paper Tab. III), and what goes beyond it."""

from chauffeur.bench.lampilot.scenes.annotations import Annotation, annotated, load_annotations

__all__ = ["Annotation", "annotated", "load_annotations"]
