"""A planner that looks: how dark the picture of the front camera is decides how fast it drives.

    [project.entry-points."chauffeur.planners"]
    lookout = "lookout:Lookout"

It says so by `sees`; the pictures come with the request.
"""

import time

from chauffeur.concept import Parameters, Plan, PlannerError, Thoughts

DARK = 90.0
"""Mean brightness, 0 to 255, below which the day is called dark."""
SHARE = {"dark": 0.7, "light": 0.9}
"""Of the speed limit."""


class Lookout:
    """Slower in the dark."""

    id, model, sees = "lookout", "lookout-v1", True

    @classmethod
    def from_spec(cls, argument):
        return cls()

    async def plan(self, request):
        begun = time.perf_counter()
        if not request.images:
            raise PlannerError("There is no picture to look at.", hint="Drive in a world with a camera.")
        brightness = request.images[-1].pixels().mean()
        light = "dark" if brightness < DARK else "light"
        speed = round(SHARE[light] * request.context.situation.speed_limit_mps, 2)
        return Plan(
            Thoughts(f"It is {light} ahead (brightness {brightness:.0f}); I drive at {speed} m/s."),
            Parameters(speed, 12.0, 1.0),
            intent="speed.set",
            settings=(("target_speed_mps", speed),),
            planner=self.id,
            model=self.model,
            latency_s=time.perf_counter() - begun,
        )
