"""From keys to wheel and pedals: smooth ramps, so that a key that is only down or up can be a little or a lot.

A tap moves the wheel a hair, a held key moves it all the way; a released key lets it return by itself. How much the
full wheel turns the front wheels falls with speed, so that the sideways acceleration stays within a bound. The
pedals' full scale is that of LaMPilot's vehicle, which every other method drives (control/actuation.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag

from chauffeur.concept import Command


class Keys(IntFlag):
    """Driving keys held down, as they travel from the page and stand in a trace."""

    NONE = 0
    LEFT = 1
    RIGHT = 2
    GAS = 4
    BRAKE = 8


ALL_KEYS = Keys.LEFT | Keys.RIGHT | Keys.GAS | Keys.BRAKE


@dataclass(frozen=True, slots=True)
class WheelGains:
    """How keys move wheel and pedals; positions run from -1 to 1, rates are positions per second.

    Attributes:
        max_acceleration_mps2: Full throttle, and full brake.
        throttle_per_s, brake_per_s: How fast a held key presses its pedal.
        release_per_s: How fast a pedal comes back.
        max_steering_rad: Front wheels at full wheel, at low speed.
        max_lateral_mps2: Sideways acceleration that full wheel may cause; sets the steering bound at speed.
        wheel_per_s: How fast a held key turns the wheel away from the middle.
        return_per_s: How fast a wheel left alone turns back.
        counter_per_s: How fast a key turns it back from the other side.
        fine: Share of the wheel's response that is linear; the rest is cubic, so that small positions steer finely.
        axles_m: Distance of the axles.
    """

    max_acceleration_mps2: float = 5.0
    throttle_per_s: float = 1.25
    brake_per_s: float = 2.5
    release_per_s: float = 5.0
    max_steering_rad: float = 0.6
    max_lateral_mps2: float = 5.0
    wheel_per_s: float = 1.6
    return_per_s: float = 3.2
    counter_per_s: float = 4.8
    fine: float = 0.15
    axles_m: float = 5.0


@dataclass(frozen=True, slots=True)
class Positions:
    """Where wheel (right is positive) and pedal (throttle is positive, brake negative) stand, -1 to 1."""

    wheel: float = 0.0
    pedal: float = 0.0


def moved(at: Positions, keys: Keys, dt_s: float, gains: WheelGains) -> Positions:
    """Positions one control period later, with these keys held. Opposite keys cancel, but the brake beats the gas."""
    turn = int(bool(keys & Keys.RIGHT)) - int(bool(keys & Keys.LEFT))
    if turn == 0:
        wheel = _towards(at.wheel, 0.0, gains.return_per_s * dt_s)
    elif at.wheel * turn < 0.0:
        wheel = _towards(at.wheel, 0.0, gains.counter_per_s * dt_s)
    else:
        wheel = _towards(at.wheel, float(turn), gains.wheel_per_s * dt_s)
    push = -1.0 if keys & Keys.BRAKE else 1.0 if keys & Keys.GAS else 0.0
    if push == 0.0:
        pedal = _towards(at.pedal, 0.0, gains.release_per_s * dt_s)
    else:
        # The foot leaves one pedal before it presses the other.
        start = at.pedal if at.pedal * push > 0.0 else 0.0
        pedal = _towards(start, push, (gains.throttle_per_s if push > 0.0 else gains.brake_per_s) * dt_s)
    return Positions(wheel, pedal)


def command_of(at: Positions, speed_mps: float, dt_s: float, gains: WheelGains) -> Command:
    """What the positions ask of the vehicle at a speed. The brake stops the car and never drives it backwards."""
    acceleration = at.pedal * gains.max_acceleration_mps2
    if speed_mps <= 0.0 or speed_mps + acceleration * dt_s < 0.0:
        acceleration = max(acceleration, -speed_mps / dt_s)
    response = at.wheel * (gains.fine + (1.0 - gains.fine) * at.wheel * at.wheel)
    return Command(acceleration, 0.0 - response * steering_bound_rad(speed_mps, gains))


def steering_bound_rad(speed_mps: float, gains: WheelGains) -> float:
    """Front-wheel angle at full wheel: yaw rate is about speed x angle / axle distance, and it times speed is bound."""
    bound = gains.axles_m * gains.max_lateral_mps2
    squared = speed_mps**2
    return gains.max_steering_rad if gains.max_steering_rad * squared <= bound else bound / squared


def _towards(value: float, target: float, most: float) -> float:
    return target if abs(target - value) <= most else value + (most if target > value else -most)
