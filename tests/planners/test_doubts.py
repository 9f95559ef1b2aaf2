"""A doubt never lowers care: one more source that contradicts, or one fewer, and no plan is bolder for it."""

from __future__ import annotations

import asyncio
import hashlib
import json
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from server import Answer, ModelServer, Request, fails, whole

from chauffeur.concept import (
    ActionMatrix,
    CameraImage,
    Context,
    Instruction,
    Lead,
    Plan,
    PlanRequest,
    Situation,
    SystemMessage,
)
from chauffeur.concept.weather import Weather
from chauffeur.driving.seat import SeatCamera
from chauffeur.planners.base import Planner
from chauffeur.planners.camera_faults import picture_fault
from chauffeur.planners.motion import MotionPlanner
from chauffeur.planners.prompts.motion import matrix_words
from chauffeur.planners.registry import make_planner
from chauffeur.planners.vlm import VlmPlanner
from chauffeur.planners.weather_doubts import target_mps
from chauffeur.safety.gain_box import care, gain_box, most_careful

WEATHERS: tuple[Weather, ...] = ("sunny", "night", "rain", "fog", "snow")
WISHES = ("I'm late, hurry", "Very gently, please")
SAID = ("but it is slippery", "and mind the fog", "though it's raining")
TOLD = ("clear sky, dry", "heavy snow")
FAULTS = ("off", "black", "stamped", "blank", "half-black", "blurred", "frozen")
TRACK = Situation("track", 8.3, 13.9, 1, 0, False, None, None)
ROAD = Situation("highway", 25.0, 31.3, 3, 1, False, Lead(1, 40.0, 22.0), None)


@cache
def view(weather: Weather) -> CameraImage:
    """What the front camera shows of a left turn."""
    pytest.importorskip("osqp")
    from chauffeur.worlds.track import TrackWorld, track_scenario

    world = TrackWorld()
    return SeatCamera(world, 3, weather).take(world.reset(track_scenario("left_turn", weather)))[0]


def broken(image: CameraImage, fault: str) -> tuple[CameraImage, ...]:
    """The pictures of a camera that fails."""
    from PIL import Image, ImageFilter

    pixels = image.pixels().copy()
    match fault:
        case "off":
            return ()
        case "frozen":
            return image, replace(image, time_s=image.time_s + 1.0)
        case "black" | "stamped":
            pixels[:] = 0
            pixels[4:10, 4:60] = 255 if fault == "stamped" else 0
        case "blank":
            pixels[:] = 127
        case "half-black":
            pixels[:, pixels.shape[1] // 2 :] = 0
        case _:
            pixels = np.asarray(Image.fromarray(pixels).filter(ImageFilter.GaussianBlur(5)))
    return (replace(image, picture=pixels),)


def asked(wish: str, said: str = "", told: str = "", images: tuple[CameraImage, ...] = ()) -> PlanRequest:
    situation = replace(TRACK, scene=(("weather", told),) if told else ())
    words = f"I am on a test track. Weather here: {told}." if told else "I am on a test track."
    text = f"{wish}, {said}." if said else f"{wish}."
    return PlanRequest(Instruction(text), Context(words, situation), SystemMessage(""), images=images)


def care_of(planner: Planner, request: PlanRequest) -> float:
    plan = asyncio.run(planner.plan(request))
    assert isinstance(plan.policy, ActionMatrix)
    return care(plan.policy)


# Pictures -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("weather", WEATHERS)
def test_a_sound_picture_has_no_fault_in_any_weather(weather: Weather) -> None:
    assert picture_fault(view(weather).pixels()) == ""


@pytest.mark.parametrize("fault", [fault for fault in FAULTS if fault not in ("off", "frozen")])
@pytest.mark.parametrize("weather", WEATHERS)
def test_a_broken_picture_is_found(weather: Weather, fault: str) -> None:
    (image,) = broken(view(weather), fault)
    assert picture_fault(image.pixels())


# Gains ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wish", WISHES)
@pytest.mark.parametrize("weather", WEATHERS)
def test_the_on_board_model_never_loses_care_by_a_doubt(weather: Weather, wish: str) -> None:
    image = view(weather)
    cares = {
        (said, told): care_of(VlmPlanner.from_spec(""), asked(wish, said, told, (image,)))
        for said, told in product(("", *SAID[:2]), ("", *TOLD))
    }
    for (said, told), found in cares.items():
        assert found >= cares[said, ""] and found >= cares["", told], (said, told)
    for fault in FAULTS:
        blind = asyncio.run(VlmPlanner.from_spec("").plan(asked(wish, images=broken(image, fault))))
        assert isinstance(blind.policy, ActionMatrix) and care(blind.policy) >= max(cares.values())
        assert "camera" in blind.scene.casefold() and blind.scene in blind.thoughts.text


class Moody(ModelServer):
    """A model whose gains have nothing to do with what it is told."""

    def take(self, request: Request) -> Answer:
        self.requests.append(request)
        words = json.dumps(request.body["messages"]).encode()
        shares = [byte / 255.0 for byte in hashlib.sha256(words).digest()[:6]]
        box = gain_box()
        ends = zip(box.low.values(), box.high.values(), shares, strict=True)
        kp, ki, kd, wl, wh, ws = (low + share * (high - low) for low, high, share in ends)
        return whole(f"Thoughts: Some.\nP = {matrix_words(ActionMatrix((kp, ki, kd), (wl, wh, ws)))}")


@pytest.fixture
def moody() -> Iterator[Moody]:
    running = Moody()
    yield running
    running.close()


@pytest.mark.server
@pytest.mark.parametrize("wish", WISHES)
def test_no_served_model_loses_care_by_a_doubt(moody: Moody, wish: str) -> None:
    async def cares() -> tuple[dict[tuple[str, str], float], list[float]]:
        planner = MotionPlanner.from_spec("m", base_url=moody.url, cache=False)
        found = {
            (said, told): gains_care(await planner.plan(asked(wish, said, told)))
            for said, told in product(("", *SAID), ("", *TOLD))
        }
        blind = [
            gains_care(await planner.plan(asked(wish, images=broken(view("sunny"), fault))))
            for fault in FAULTS
            if fault != "off"
        ]
        await planner.close()
        return found, blind

    found, blind = asyncio.run(cares())
    for (said, told), value in found.items():
        assert value >= found["", told], (said, told)
        contradicts = said and told == "clear sky, dry"
        assert not contradicts or value >= found[said, ""], (said, told)
    assert min(blind) >= max(found.values()) and min(blind) == pytest.approx(care(most_careful()))


def gains_care(plan: Plan) -> float:
    assert isinstance(plan.policy, ActionMatrix)
    return care(plan.policy)


@pytest.mark.server
def test_a_served_model_is_shown_pictures_and_one_without_eyes_is_asked_in_words(moody: Moody) -> None:
    async def plans() -> list[Plan]:
        planner = MotionPlanner.from_spec("m", base_url=moody.url, cache=False)
        assert planner.sees
        shown = await planner.plan(asked(WISHES[0], told="heavy snow", images=(view("snow"),)))
        await planner.close()
        return [shown]

    (shown,) = asyncio.run(plans())
    assert shown.policy is not None
    sent = json.dumps(moody.requests[0].body["messages"])
    assert "image_url" in sent and "heavy snow" in sent


@pytest.mark.server
def test_a_model_without_eyes_goes_on_in_words(server: ModelServer) -> None:
    server.script(
        fails(400, "image_url is only supported by certain models"),
        whole("Thoughts: So.\nP = [[0.2, 0.01, 0.1], [5, 10, 300]]"),
    )

    async def planned() -> tuple[Plan, bool]:
        planner = MotionPlanner.from_spec("m", base_url=server.url, cache=False)
        plan = await planner.plan(asked(WISHES[0], images=(view("sunny"),)))
        await planner.close()
        return plan, planner.sees

    plan, sees = asyncio.run(planned())
    assert plan.policy is not None and not sees
    assert "image_url" not in json.dumps(server.requests[-1].body["messages"])


# Speeds ---------------------------------------------------------------------------------------------------------------

PACES = ("I'm late, hurry", "Step on it", "Be quick", "Take it easy", "Drive at 100 km/h", "Overtake the car ahead")


@pytest.mark.parametrize("spec", ["meaning", "onboard", "talk2drive"])
def test_words_on_the_weather_make_no_plan_faster(spec: str) -> None:
    if spec != "meaning":
        pytest.importorskip("onnxruntime")
    planner = make_planner(spec)

    def plan(text: str, told: str = "") -> Plan:
        situation = replace(ROAD, scene=(("weather", told),) if told else ())
        return asyncio.run(planner.plan(PlanRequest(Instruction(text), Context("", situation), SystemMessage(""))))

    for wish in PACES:
        bare = plan(f"{wish}.")
        most = target_mps(bare) or ROAD.speed_mps
        for said, told in product(SAID, ("", *TOLD)):
            doubted = plan(f"{wish}, {said}.", told)
            assert doubted.policy is None or (target_mps(doubted) or ROAD.speed_mps) <= most, (wish, said, told)
