from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

class RoadObject:
    LENGTH: float
    WIDTH: float
    position: NDArray[np.float64]
    heading: float
    speed: float
    lane_index: Any
    lane: Any
    crashed: bool
    diagonal: float
    def __init__(self, road: Any, position: ArrayLike, heading: float = ..., speed: float = ...) -> None: ...

class Landmark(RoadObject): ...
class Obstacle(RoadObject): ...
