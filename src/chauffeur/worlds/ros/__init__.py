"""Vehicles behind ROS: checked parameters in, messages for the vehicle's own planner out."""

from chauffeur.worlds.ros.base import (
    Published,
    RosVehicleState,
    VehicleError,
    VehicleInterface,
    VehicleRefusalError,
)
from chauffeur.worlds.ros.limits import VehicleLimits

__all__ = [
    "Published",
    "RosVehicleState",
    "VehicleError",
    "VehicleInterface",
    "VehicleLimits",
    "VehicleRefusalError",
]
