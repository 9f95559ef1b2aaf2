"""Talk2Drive's planner (paper Sec. V): words to controller parameters, with the on-board model or any endpoint."""

from chauffeur.planners.talk2drive.planner import Talk2DrivePlanner

__all__ = ["Talk2DrivePlanner"]
