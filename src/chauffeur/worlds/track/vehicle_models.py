"""CommonRoad's vehicle models, written out: single-track (ST), single-track with drift (STD), multi-body (MB).

Source: M. Althoff, G. Würsching, "CommonRoad: Vehicle Models", 2020; names are the paper's. States, SI units:

    ST   x, y, steering angle, speed, yaw, yaw rate, slip angle
    STD  as ST, then the angular speeds of the front and the rear wheel
    MB   x, y, steering angle, speed ahead, yaw, yaw rate, roll, roll rate, pitch, pitch rate, speed to the left, z,
         speed in z; of the front and of the rear axle roll, roll rate, speed to the left, z, speed in z; angular speeds
         of the wheels (left front, right front, left rear, right rear); displacement of the front and the rear joint

Tyres follow Pacejka's magic formula without turn slip. A factor of friction scales their peak, along and across: what
wet and snow do. Sums are taken in the order of CommonRoad's package, whose numbers these are to rounding.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable
from typing import Any, Final

import numpy as np

_G: Final = 9.81
_SLOW_MPS: Final = 0.1
"""Slower than this ST and MB are kinematic."""
_MIXED_MPS, _MIX_WIDTH_MPS = 0.2, 0.05
"""STD passes over to the kinematic model around this speed, within this width."""
_ROLLING_S: Final = 0.02
"""Time in which a slow wheel of STD takes on the speed of the ground."""


def _constants(name: str, group: Any) -> Any:
    """A parameter group as a tuple with names, which the compiler takes for constants."""
    found = {key: float(value) for key, value in vars(group).items() if isinstance(value, int | float)}
    return namedtuple(name, found)(**found)  # pyright: ignore[reportUntypedNamedTuple]


def derivative(plant: str, vehicle: Any) -> Callable[..., Any]:
    """Compile a model: (state (n,), (steering velocity rad/s, acceleration m/s2), friction) -> derivative (n,).

    Args:
        plant: `st`, `std` or `mb`.
        vehicle: CommonRoad's parameters.
    """
    import numba

    jit: Any = numba.njit(error_model="numpy")
    p, tyre = _constants("Vehicle", vehicle), _constants("Tyre", vehicle.tire)
    steering, drive = _constants("Steering", vehicle.steering), _constants("Drive", vehicle.longitudinal)
    base = p.a + p.b

    @jit
    def bounded(x: Any, u: Any) -> tuple[float, float]:
        """Inputs within the bounds of the steering and of the drive."""
        turn, acceleration = u[0], u[1]
        if (x[2] <= steering.min and turn <= 0.0) or (x[2] >= steering.max and turn >= 0.0):
            turn = 0.0
        turn = min(max(turn, steering.v_min), steering.v_max)
        most = drive.a_max * drive.v_switch / x[3] if x[3] > drive.v_switch else drive.a_max
        if (x[3] <= drive.v_min and acceleration <= 0.0) or (x[3] >= drive.v_max and acceleration >= 0.0):
            acceleration = 0.0
        return turn, min(max(acceleration, -drive.a_max), most)

    @jit
    def kinematic(x: Any, turn: float, acceleration: float, slip: float) -> tuple[float, float, float, float]:
        """(slip angle, yaw rate, its derivative, that of the slip angle) of a car that rolls without slip."""
        tan, cos = math.tan(x[2]), math.cos(x[2])
        beta = math.atan(tan * p.b / base)
        d_beta = (p.b * turn) / (base * cos**2 * (1 + (tan**2 * p.b / base) ** 2))
        dd_psi = (
            1
            / base
            * (
                acceleration * math.cos(slip) * tan
                - x[3] * math.sin(slip) * d_beta * tan
                + x[3] * math.cos(slip) * turn / cos**2
            )
        )
        return beta, x[3] * math.cos(beta) * tan / base, dd_psi, d_beta

    @jit
    def magic(b: float, e: float, slip: float) -> float:
        """The inner part of the magic formula."""
        return math.atan(b * slip - e * (b * slip - math.atan(b * slip)))

    @jit
    def forces(slip: float, alpha: float, gamma: float, load: float, friction: float) -> tuple[float, float]:
        """(longitudinal, lateral) force of a tyre at a slip along, a slip angle and a camber, under a load."""
        mu_x = tyre.p_dx1 * friction * (1 - tyre.p_dx3 * gamma**2)
        d = mu_x * load
        b = load * tyre.p_kx1 / (tyre.p_cx1 * d)
        pure_x = d * math.sin(tyre.p_cx1 * magic(b, tyre.p_ex1, -slip + tyre.p_hx1) + load * tyre.p_vx1)
        sign = 1.0 if gamma > 0 else -1.0 if gamma < 0 else 0.0
        shift = sign * (tyre.p_hy1 + tyre.p_hy3 * math.fabs(gamma))
        rise = sign * load * (tyre.p_vy1 + tyre.p_vy3 * math.fabs(gamma))
        mu_y = tyre.p_dy1 * friction * (1 - tyre.p_dy3 * gamma**2)
        d = mu_y * load
        b = load * tyre.p_ky1 / (tyre.p_cy1 * d)
        pure_y = d * math.sin(tyre.p_cy1 * magic(b, tyre.p_ey1, alpha + shift)) + rise
        # Each force is less for the slip along the other axis.
        b = tyre.r_bx1 * math.cos(math.atan(tyre.r_bx2 * slip))
        d = pure_x / math.cos(tyre.r_cx1 * magic(b, tyre.r_ex1, tyre.r_hx1))
        along = d * math.cos(tyre.r_cx1 * magic(b, tyre.r_ex1, alpha + tyre.r_hx1))
        b = tyre.r_by1 * math.cos(math.atan(tyre.r_by2 * (alpha - tyre.r_by3)))
        d = pure_y / math.cos(tyre.r_cy1 * magic(b, tyre.r_ey1, tyre.r_hy1))
        side = mu_y * load * (tyre.r_vy1 + tyre.r_vy3 * gamma) * math.cos(math.atan(tyre.r_vy4 * alpha))
        side *= math.sin(tyre.r_vy5 * math.atan(tyre.r_vy6 * slip))
        return along, d * math.cos(tyre.r_cy1 * magic(b, tyre.r_ey1, slip + tyre.r_hy1)) + side

    @jit
    def torques(acceleration: float) -> tuple[float, float]:
        """(front, rear) torque of brakes and engine, split among the axles."""
        torque = p.m * p.R_w * acceleration
        braking, driving = (0.0, torque) if acceleration > 0 else (torque, 0.0)
        return p.T_sb * braking + p.T_se * driving, (1 - p.T_sb) * braking + (1 - p.T_se) * driving

    def st(x: Any, u: Any, friction: float) -> Any:
        turn, acceleration = bounded(x, u)
        v, psi, yaw, beta = x[3], x[4], x[5], x[6]
        f = np.empty(7)
        f[2], f[3] = turn, acceleration
        if abs(v) < _SLOW_MPS:
            rolled, f[4], f[5], f[6] = kinematic(x, turn, acceleration, beta)
            f[0], f[1] = v * math.cos(rolled + psi), v * math.sin(rolled + psi)
            return f
        mu, lf, lr = tyre.p_dy1 * friction, p.a, p.b
        stiffness = -tyre.p_ky1 / mu
        front, rear = _G * lr - acceleration * p.h_s, _G * lf + acceleration * p.h_s
        f[0], f[1] = v * math.cos(beta + psi), v * math.sin(beta + psi)
        f[4] = yaw
        f[5] = (
            -mu * p.m / (v * p.I_z * (lr + lf)) * (lf**2 * stiffness * front + lr**2 * stiffness * rear) * yaw
            + mu * p.m / (p.I_z * (lr + lf)) * (lr * stiffness * rear - lf * stiffness * front) * beta
            + mu * p.m / (p.I_z * (lr + lf)) * lf * stiffness * front * x[2]
        )
        f[6] = (
            (mu / (v**2 * (lr + lf)) * (stiffness * rear * lr - stiffness * front * lf) - 1) * yaw
            - mu / (v * (lr + lf)) * (stiffness * rear + stiffness * front) * beta
            + mu / (v * (lr + lf)) * (stiffness * front) * x[2]
        )
        return f

    def std(x: Any, u: Any, friction: float) -> Any:
        turn, acceleration = bounded(x, u)
        delta, v, psi, yaw, beta, lf, lr = x[2], x[3], x[4], x[5], x[6], p.a, p.b
        cos, sin = math.cos(beta), math.sin(beta)
        least = _MIXED_MPS / 2
        moving = v > least
        alpha_f = math.atan((v * sin + yaw * lf) / (v * cos)) - delta if moving else 0.0
        alpha_r = math.atan((v * sin - yaw * lr) / (v * cos)) if moving else 0.0
        load_f = p.m * (-acceleration * p.h_s + _G * lr) / (lr + lf)
        load_r = p.m * (acceleration * p.h_s + _G * lf) / (lr + lf)
        speed_f = max(0.0, v * cos * math.cos(delta) + (v * sin + lf * yaw) * math.sin(delta))
        speed_r = max(0.0, v * cos)
        fx, fy = forces(1 - p.R_w * x[7] / max(speed_f, least), alpha_f, 0.0, load_f, friction)
        rx, ry = forces(1 - p.R_w * x[8] / max(speed_r, least), alpha_r, 0.0, load_r, friction)
        torque_f, torque_r = torques(acceleration)
        cos_f, sin_f = math.cos(delta - beta), math.sin(delta - beta)
        d_v = 1 / p.m * (-fy * sin_f + ry * sin + rx * cos + fx * cos_f)
        dd_psi = 1 / p.I_z * (fy * math.cos(delta) * lf - ry * lr + fx * math.sin(delta) * lf)
        d_beta = -yaw + 1 / (p.m * v) * (fy * cos_f + ry * cos - rx * sin + fx * sin_f) if moving else 0.0
        spin_f = 1 / p.I_y_w * (-p.R_w * fx + torque_f) if x[7] >= 0 else 0.0
        spin_r = 1 / p.I_y_w * (-p.R_w * rx + torque_r) if x[8] >= 0 else 0.0
        _, rolled_yaw, rolled_dd_psi, rolled_d_beta = kinematic(x, turn, acceleration, beta)
        rolled_f = (1 / _ROLLING_S) * (speed_f / p.R_w - max(0.0, x[7]))
        rolled_r = (1 / _ROLLING_S) * (speed_r / p.R_w - max(0.0, x[8]))
        share = 0.5 * (math.tanh((v - _MIXED_MPS) / _MIX_WIDTH_MPS) + 1)
        rest = 1 - share
        f = np.empty(9)
        f[0], f[1], f[2] = v * math.cos(beta + psi), v * math.sin(beta + psi), turn
        f[3] = share * d_v + rest * acceleration
        f[4] = share * yaw + rest * rolled_yaw
        f[5] = share * dd_psi + rest * rolled_dd_psi
        f[6] = share * d_beta + rest * rolled_d_beta
        f[7] = share * spin_f + rest * rolled_f
        f[8] = share * spin_r + rest * rolled_r
        return f

    # Of the front and the rear axle: distance from the centre of gravity (ahead), that of the other, track, height of
    # the roll axis, rates of springs, dampers and torsion, camber, unsprung mass and inertia.
    reach, other, track, height = (p.a, -p.b), (p.b, p.a), (p.T_f, p.T_r), (p.h_raf - p.R_w, p.h_rar - p.R_w)
    spring, damper, torsion = (p.K_sf, p.K_sr), (p.K_sdf, p.K_sdr), (p.K_tsf, p.K_tsr)
    camber_1, camber_2, mass, inertia = (p.D_f, p.D_r), (p.E_f, p.E_r), (p.m_uf, p.m_ur), (p.I_uf, p.I_ur)

    def mb(x: Any, u: Any, friction: float) -> Any:
        turn, acceleration = bounded(x, u)
        v, psi, yaw, roll, pitch, side_mps = x[3], x[4], x[5], x[6], x[8], x[10]
        slow = abs(v) < _SLOW_MPS
        cos, sin = math.cos(roll), math.sin(roll)
        f = np.empty(29)
        along, across, load, strut = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
        joint = np.empty(2)
        for axle in range(2):
            at, half, here = reach[axle], 0.5 * track[axle], 13 + 5 * axle
            axle_roll, axle_z = x[here], x[here + 3]
            delta = x[2] if axle == 0 else 0.0
            sunk = p.h_s - p.R_w + axle_z - x[11]
            for right in range(2):
                wheel, sign = 2 * axle + right, 1.0 - 2.0 * right
                load[wheel] = (
                    axle_z + p.R_w * (math.cos(axle_roll) - 1) - sign * (half * math.sin(axle_roll))
                ) * p.K_zt
                ahead_mps = v + sign * half * yaw
                speed = ahead_mps * math.cos(delta) + (side_mps + at * yaw) * math.sin(delta)
                if speed < 0.0:
                    speed *= 0.0
                slip = 0.0 if slow else 1 - p.R_w * x[23 + wheel] / speed
                alpha = 0.0
                if not slow:
                    alpha = math.atan((side_mps + at * yaw - x[here + 1] * (p.R_w - axle_z)) / ahead_mps) - delta
                leans = sign * (0.5 * (roll - axle_roll) * track[axle])
                z = sunk / cos - p.h_s + p.R_w + at * pitch + leans
                dz = x[here + 4] - x[12] + at * x[9] + sign * (0.5 * (x[7] - x[here + 1]) * track[axle])
                gamma = roll + sign * (camber_1[axle] * z) + sign * (camber_2[axle] * z**2)
                along[wheel], across[wheel] = forces(slip, alpha, gamma, load[wheel], friction)
                strut[wheel] = (
                    p.m_s * _G * other[axle] / (2 * base)
                    - z * spring[axle]
                    - dz * damper[axle]
                    + sign * ((roll - axle_roll) * torsion[axle] / track[axle])
                )
            turned, d_y, up = roll - axle_roll, side_mps + at * yaw - x[here + 2], x[here + 4] - x[12]
            gap = sunk * sin - x[27 + axle] * cos - height[axle] * math.sin(turned)
            d_gap = (
                (sunk * cos + x[27 + axle] * sin) * x[7]
                + up * sin
                - d_y * cos
                - height[axle] * math.cos(turned) * (x[7] - x[here + 1])
            )
            joint[axle] = gap * p.K_ras + d_gap * p.K_rad
            f[27 + axle] = d_y
        front_x, front_y = along[0] + along[1], across[0] + across[1]
        rear_y, struts_f, struts_r = across[2] + across[3], strut[0] + strut[1], strut[2] + strut[3]
        cos_d, sin_d = math.cos(x[2]), math.sin(x[2])
        sum_x = along[2] + along[3] + front_x * cos_d - front_y * sin_d
        sum_n = (
            front_y * p.a * cos_d
            + front_x * p.a * sin_d
            + (across[1] - across[0]) * 0.5 * p.T_f * sin_d
            + (along[0] - along[1]) * 0.5 * p.T_f * cos_d
            + (along[2] - along[3]) * 0.5 * p.T_r
            - rear_y * p.b
        )
        struts = strut[0] + strut[2] + strut[1] + strut[3]
        joints = joint[0] + joint[1]
        sum_l = (
            0.5 * strut[0] * p.T_f
            + 0.5 * strut[2] * p.T_r
            - 0.5 * strut[1] * p.T_f
            - 0.5 * strut[3] * p.T_r
            - joint[0] / cos * (p.h_s - x[11] - p.R_w + x[16] - height[0] * math.cos(x[13]))
            - joint[1] / cos * (p.h_s - x[11] - p.R_w + x[21] - height[1] * math.cos(x[18]))
        )
        drawn = front_x * cos_d - front_y * sin_d + along[2] + along[3]
        sum_m = p.a * struts_f - p.b * struts_r + drawn * (p.h_s - x[11])
        if slow:
            beta, f[4], f[5], _ = kinematic(x, turn, acceleration, roll)
            speed, f[3] = v, acceleration
        else:
            beta, speed = math.atan(side_mps / v), math.sqrt(v**2 + side_mps**2)
            f[3], f[4] = 1 / p.m * sum_x + yaw * side_mps, yaw
            f[5] = 1 / (p.I_z - p.I_xz_s**2 / p.I_Phi_s) * (sum_n + p.I_xz_s / p.I_Phi_s * sum_l)
        f[0], f[1], f[2] = math.cos(beta + psi) * speed, math.sin(beta + psi) * speed, turn
        f[6], f[8], f[11] = x[7], x[9], x[12]
        f[7] = 1 / (p.I_Phi_s - p.I_xz_s**2 / p.I_z) * (p.I_xz_s / p.I_z * sum_n + sum_l)
        f[9] = 1 / p.I_y_s * sum_m
        f[10] = 1 / p.m_s * (joints * cos + struts * sin) - yaw * v
        f[12] = _G - 1 / p.m_s * (struts * cos - joints * sin)
        torque = torques(acceleration)
        for axle in range(2):
            left, right, here = 2 * axle, 2 * axle + 1, 13 + 5 * axle
            axle_roll, axle_z, half = x[here], x[here + 3], 0.5 * track[axle]
            lateral = front_y * cos_d + front_x * sin_d if axle == 0 else rear_y
            pair, leant = struts_f if axle == 0 else struts_r, p.R_w * math.sin(axle_roll)
            sum_l = (
                0.5 * strut[right] * track[axle]
                - 0.5 * strut[left] * track[axle]
                - joint[axle] * height[axle]
                + load[left] * (leant + half * math.cos(axle_roll) - p.K_lt * across[left])
                - load[right] * (-leant + half * math.cos(axle_roll) + p.K_lt * across[right])
                - lateral * (p.R_w - axle_z)
            )
            f[here], f[here + 3] = x[here + 1], x[here + 4]
            f[here + 1] = 1 / inertia[axle] * sum_l
            f[here + 2] = 1 / mass[axle] * (lateral - joint[axle] * cos - pair * sin) - yaw * v
            f[here + 4] = _G - 1 / mass[axle] * (load[left] + load[right] + joint[axle] * sin - pair * cos)
            for wheel in range(left, right + 1):
                spin = 1 / p.I_y_w * (-p.R_w * along[wheel] + 0.5 * torque[axle])
                f[23 + wheel] = 0.0 if x[23 + wheel] < 0.0 else spin
        return f

    return jit({"st": st, "std": std, "mb": mb}[plant])
