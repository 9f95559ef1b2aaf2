from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

class LineType:
    NONE: int
    STRIPED: int
    CONTINUOUS: int
    CONTINUOUS_LINE: int

class AbstractLane:
    length: float
    width: float
    forbidden: bool
    speed_limit: float
    priority: int
    line_types: Any
    start: NDArray[np.float64]
    def position(self, longitudinal: float, lateral: float) -> NDArray[np.float64]: ...
    def local_coordinates(self, position: NDArray[np.float64]) -> tuple[float, float]: ...
    def heading_at(self, longitudinal: float) -> float: ...
    def width_at(self, longitudinal: float) -> float: ...
    def distance_with_heading(
        self, position: NDArray[np.float64], heading: float | None, heading_weight: float = ...
    ) -> float: ...

class StraightLane(AbstractLane):
    def __init__(
        self,
        start: ArrayLike,
        end: ArrayLike,
        width: float = ...,
        line_types: Any = ...,
        forbidden: bool = ...,
        speed_limit: float = ...,
        priority: int = ...,
    ) -> None: ...

class SineLane(StraightLane):
    amplitude: float
    pulsation: float
    phase: float
    def __init__(
        self,
        start: ArrayLike,
        end: ArrayLike,
        amplitude: float,
        pulsation: float,
        phase: float,
        width: float = ...,
        line_types: Any = ...,
        forbidden: bool = ...,
        speed_limit: float = ...,
        priority: int = ...,
    ) -> None: ...

class CircularLane(AbstractLane):
    center: NDArray[np.float64]
    radius: float
    start_phase: float
    end_phase: float
    direction: int
    def __init__(
        self,
        center: ArrayLike,
        radius: float,
        start_phase: float,
        end_phase: float,
        clockwise: bool = ...,
        width: float = ...,
        line_types: Any = ...,
        forbidden: bool = ...,
        speed_limit: float = ...,
        priority: int = ...,
    ) -> None: ...
