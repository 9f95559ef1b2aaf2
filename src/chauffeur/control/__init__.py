"""Controllers as pure functions of numbers: they know no simulator, no road and no model."""

from chauffeur.control.actuation import LAMPILOT_HIGHWAY, LAMPILOT_INTERSECTION, Actuation, full_scale
from chauffeur.control.idm import LAMPILOT_EGO, IdmParameters, desired_gap_m, guard_zero, idm_acceleration
from chauffeur.control.lane_keeping import LAMPILOT_STEERING, LaneKeepingParameters, lane_keeping_steering
from chauffeur.control.mobil import LaneChangeOutlook, MobilParameters, should_change

__all__ = [
    "LAMPILOT_EGO",
    "LAMPILOT_HIGHWAY",
    "LAMPILOT_INTERSECTION",
    "LAMPILOT_STEERING",
    "Actuation",
    "IdmParameters",
    "LaneChangeOutlook",
    "LaneKeepingParameters",
    "MobilParameters",
    "desired_gap_m",
    "full_scale",
    "guard_zero",
    "idm_acceleration",
    "lane_keeping_steering",
    "should_change",
]
