"""The way to a vehicle that its configuration file asks for."""

from __future__ import annotations

from chauffeur.worlds.ros.autoware_ai import AutowareAi
from chauffeur.worlds.ros.base import VehicleInterface
from chauffeur.worlds.ros.dry import DryRun
from chauffeur.worlds.ros.settings import VehicleSettings


def open_vehicle(settings: VehicleSettings, *, dry_run: bool = False) -> VehicleInterface:
    """Open the interface; it connects by itself, and again when it was lost.

    Args:
        settings: As read from the vehicle's file.
        dry_run: Publish nothing, whatever the file says.

    Raises:
        VehicleError: The vehicle's or our own address cannot be used.
        MissingExtraError: A library is not installed.
    """
    stack = settings.stack
    if dry_run or settings.interface == "dry-run":
        return DryRun(stack, 1 if isinstance(stack, AutowareAi) else 2)
    if settings.interface == "rosbridge" or isinstance(stack, AutowareAi):  # ROS 1 is behind rosbridge only
        from chauffeur.worlds.ros.rosbridge import RosbridgeVehicle

        return RosbridgeVehicle(stack, settings.rosbridge)
    from chauffeur.worlds.ros.ros2 import Ros2Vehicle

    return Ros2Vehicle(stack, settings.ros2)
