"""Vehicles behind ROS: checked parameters in, messages for the vehicle's own planner out."""

from chauffeur.worlds.ros.base import (
    Published,
    TopicMessage,
    VehicleError,
    VehicleInterface,
    VehicleRefusalError,
    VehicleState,
)
from chauffeur.worlds.ros.limits import VehicleLimits

__all__ = [
    "Published",
    "TopicMessage",
    "VehicleError",
    "VehicleInterface",
    "VehicleLimits",
    "VehicleRefusalError",
    "VehicleState",
]
