"""The shield's parameters: one table, each with where it comes from.

What the shield promises holds as long as these do: others never brake harder than `others_braking_mps2`, the ego can
always brake with `braking_mps2`. They are published with every result driven under the shield.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from chauffeur.safety.shield.gaps import rss_gap_m

SHIELD_VERSION: Final = "shield-v5"
"""Changes whenever the same command could be let through differently."""


@dataclass(frozen=True, slots=True)
class ShieldParameters:
    """Parameters of responsibility-sensitive safety (Shalev-Shwartz, Shammah, Shashua 2017), for LaMPilot's vehicles.

    Attributes:
        braking_mps2: Braking the ego is sure of in an emergency: tyres on a dry road give 8 to 10 m/s2. LaMPilot's
            pedal ends at 5 (control/actuation.py), so no driver there asks for it; the shield may.
        acceleration_mps2: Hardest acceleration of the ego: full scale of that pedal.
        steering_rad: Largest steering angle the shield itself uses: full scale of the wheel on highways.
        others_braking_mps2: Hardest braking of others: the bound of highway-env's IDM (ACC_MAX).
        others_acceleration_mps2: Hardest acceleration of others while they have not yet responded: IDM's comfortable
            one, which no car of the traffic exceeds.
        others_sure_braking_mps2: What a car behind is trusted to brake with once it responds: IDM's comfortable one.
        others_response_s: Time until a car behind responds to one that enters ahead of it (ad-rss default 2 s for
            people; the simulated traffic responds within a period, 0.5 s leaves room for its lane changes' rhythm).
        margin_m: Clear distance that is left between bumpers at standstill. highway-env counts a touch one period
            ahead, so it must exceed what two cars close in within a period at walking pace.
        side_m: Clear distance to the side, between bodies, below which two cars share a lane.
        drift_mps: Sideways speed above which a car is taken to be on its way into the next lane.
        sideways_mps: Speed to the side no lane change exceeds: LaMPilot's lane keeping asks for 4 m in 0.6 s at most.
        gentle_mps2: Braking that is not called hard; harder only where the shield itself asks for it, or nobody is
            close behind.
    """

    braking_mps2: float = 8.0
    acceleration_mps2: float = 5.0
    steering_rad: float = math.pi / 4
    others_braking_mps2: float = 6.0
    others_acceleration_mps2: float = 3.0
    others_sure_braking_mps2: float = 4.0
    others_response_s: float = 0.5
    margin_m: float = 1.5
    side_m: float = 0.4
    drift_mps: float = 0.25
    sideways_mps: float = 8.0
    gentle_mps2: float = 3.0

    def entry_gap_m(self, rear_mps: float, front_mps: float, response_s: float) -> float:
        """Clear distance, m, that a car behind needs to one that enters its lane and then brakes no harder than gently.

        Args:
            rear_mps, front_mps: Speeds.
            response_s: Time until the car behind responds; 0 once it has seen the other.
        """
        return self.margin_m + rss_gap_m(
            rear_mps, front_mps, response_s, self.others_acceleration_mps2, self.others_sure_braking_mps2,
            self.gentle_mps2,
        )  # fmt: skip


LAMPILOT_SHIELD = ShieldParameters()
