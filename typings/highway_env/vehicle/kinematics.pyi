from typing import Any, ClassVar

import numpy as np
from highway_env.vehicle.objects import RoadObject
from numpy.typing import NDArray

class Vehicle(RoadObject):
    MAX_SPEED: ClassVar[float]
    MIN_SPEED: ClassVar[float]
    action: dict[str, float]
    impact: NDArray[np.float64] | None
    def step(self, dt: float) -> None: ...
    def act(self, action: Any = ...) -> None: ...
    def predict_trajectory_constant_speed(
        self, times: NDArray[np.float64]
    ) -> tuple[list[NDArray[np.float64]], list[float]]: ...
