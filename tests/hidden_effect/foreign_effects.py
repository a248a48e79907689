"""Hidden effects whose forms are not in the tool's registry, with the correct answers.

Each entry has force, torque or rotor as accepted by foreign_simulator.fly(); `variables`, any of which is correct;
`names`, effects of the same kind that may be reported; `left`, words of unexplained.depends_on, any of which is
correct; `formula`, the true form as [effect.expression] with its true values.
"""

import math


def column(a=0.03, x0=0.2, y0=-0.1, w=0.25):
    return lambda s: (0, 0, a * math.exp(-((s.p[0] - x0) ** 2 + (s.p[1] - y0) ** 2) / (2 * w * w)))


def expression(target, text, **parameters):
    linear = [name for name in parameters if name.endswith("_N")]
    values = ", ".join(f"{name} = {value}" for name, value in parameters.items())
    quoted = ", ".join(f'"{name}"' for name in linear)
    return (f'[[effect]]\nname = "truth"\nparameters = {{ {values} }}\n[effect.expression]\n'
            f'{target} = "{text}"\nlinear = [{quoted}]\n')


def pull(law, **parameters):
    """A horizontal force towards each neighbour."""
    text = expression("force_x_N", law.format("dx"), **parameters)
    return text + f'force_y_N = "{law.format("dy")}"\nper_neighbour = true\n'


def wall(a=0.03, at=0.6, reach=0.2):
    return lambda s: (-a * math.exp(-(at - min(s.p[0], at)) / reach), 0, 0)


def lift_of_speed(a=0.05, half=0.4):
    return lambda s: tuple(a * (1 - math.exp(-(s.speed / half) ** 2)) * s.R[i][2] for i in range(3))


def tether(k=0.08, length=0.5):
    def force(s):
        r = math.hypot(s.p[0], s.p[1])
        pull = -k * max(0.0, r - length) / max(r, 1e-9)
        return (pull * s.p[0], pull * s.p[1], 0)
    return force


def vortex_ring(a=0.04, at=-0.4, width=0.12):
    return lambda s: (0, 0, -a * math.exp(-((s.v[2] - at) / width) ** 2 / 2))


def shear(a=0.03, middle=0.9, width=0.1):
    return lambda s: (a / (1 + math.exp(-(s.p[2] - middle) / width)), 0, 0)


def dropped(a=0.04, at=14.0):
    return lambda s: (0, 0, -a if s.t < at else 0)


def cable(a=0.02):
    return lambda s: (a * math.cos(2 * s.heading), 0, 0)


def resonance(a=0.006, at=0.55, damping=0.15):
    def force(s):
        u = s.speed / at
        return (0, 0, a / math.sqrt((1 - u * u) ** 2 + (2 * damping * u) ** 2))
    return force


def gust(a=0.02, period=1.7):
    return lambda s: (a * math.sin(2 * math.pi * s.t / period), 0, 0)


def saturation(most=0.093):
    return lambda s, k, f: f if f < most else most + 0.1 * (f - most)


def body_drag(d=0.04):
    return lambda s: tuple(s.to_world([-d * s.to_body(s.v)[0], 0, 0]))


def late_wake(a=0.05, delay=0.3, width=0.15):
    def force(s):
        total = 0.0
        for other in s.others:
            p = other(delay)
            dz = p[2] - s.p[2]
            if dz > 0.05:
                r2 = (p[0] - s.p[0]) ** 2 + (p[1] - s.p[1]) ** 2
                total -= a * math.exp(-r2 / (2 * width * width))
        return (0, 0, total)
    return force


def carpet(a=0.02, at=0.1):
    return lambda s: (0, 0, a if s.p[0] > at else 0)


def magnet(a=0.0015, x0=0.3, y0=0.2, soft=0.2):
    return lambda s: (0, 0, -a / ((s.p[0] - x0) ** 2 + (s.p[1] - y0) ** 2 + soft * soft))


def ripple(a=0.015, k=9.0):
    return lambda s: (0, a * math.sin(k * s.p[1]), 0)


def board(ax=0.25, ay=-0.15):
    return lambda s: tuple(s.to_world([ax * 0.034, ay * 0.034, 0]))


def leak(rate=0.0012):
    return lambda s: (0, 0, rate * s.t)


def hose(a=0.035, free=0.6):
    return lambda s: (0, 0, -a * max(0.0, s.p[2] - free))


def lifted_cable(a=0.045):
    return lambda s: (0, 0, -a * s.p[2])


def vibration(a=0.06, frequency_hz=6.3):
    return lambda s: (0, 0, a * math.sin(2 * math.pi * frequency_hz * s.t))


def weak_cells(knee=3.95, slope=0.6):
    return lambda s, k, f: f * (1 - slope * max(0.0, knee - s.battery))


def platform(a=0.06, from_x=0.1, top=0.4, reach=0.15):
    return lambda s: (0, 0, a * math.exp(-(max(s.p[2], top) - top) / reach) if s.p[0] > from_x else 0)


def turning_wind(a=0.02, rate=0.25):
    return lambda s: (a * math.cos(rate * s.t), a * math.sin(rate * s.t), 0)


def icing(share=0.12, after=12.0):
    return lambda s, k, f: f * (1 - share * (1 - math.exp(-s.t / after)))


def dead_band(k=0.12, free=0.35):
    return lambda s: (-k * math.copysign(max(abs(s.p[0]) - free, 0), s.p[0]), 0, 0)


def thick_air(k=0.06, from_z=0.7):
    return lambda s: tuple(-k * max(s.p[2] - from_z, 0) * v for v in s.v)


def sideslip(k=0.03):
    return lambda s: tuple(k * s.to_body(s.v)[0] * s.R[i][2] for i in range(3))


def tilt_loss(k=0.9):
    return lambda s: (0, 0, -k * (1 - s.R[2][2]))


def lane(a=0.02, middle=0.1, width=0.08):
    return lambda s: (0, -a * math.tanh((s.p[1] - middle) / width), 0)


def suction(a=0.03, reach=0.3):
    def force(s):
        total = [0.0, 0.0]
        for other in s.others:
            p = other(0.0)
            away = [p[i] - s.p[i] for i in range(3)]
            r = math.sqrt(sum(x * x for x in away)) + 1e-6
            for i in range(2):
                total[i] += a * math.exp(-r / reach) * away[i] / r
        return (total[0], total[1], 0)
    return force


def upwash(a=0.03, ahead=0.3, width=0.25):
    """A lift on one side of each neighbour."""
    def force(s):
        places = [other(0.0) for other in s.others]
        return (0, 0, sum(a * math.exp(-((p[0] - s.p[0] - ahead) ** 2 + (p[1] - s.p[1]) ** 2) / (2 * width * width))
                          for p in places))
    return force


def climb_friction(k=0.08):
    return lambda s: (0, 0, -k * abs(s.v[2]) * s.v[2])


def cells_curve(full=4.15, bend=0.9):
    return lambda s, k, f: f * (1 - bend * max(0.0, full - s.battery) ** 2)


def late_draft(k=0.03, delay=0.3):
    """A force along the past velocity of each neighbour."""
    def force(s):
        return (0, k * sum((other(delay)[1] - other(delay + 0.02)[1]) / 0.02 - s.v[1] for other in s.others), 0)
    return force


def slow_drain(a=0.04, at=15.0, width=2.0):
    return lambda s: (0, 0, -a / (1 + math.exp(-(s.t - at) / width)))


def flapping(k=0.03):
    return lambda s: tuple(s.to_world([k * s.w[1], 0, 0]))


def jet(a=0.03, z0=0.8, width=0.15, to_x=0.2):
    return lambda s: (0, a * math.exp(-((s.p[2] - z0) / width) ** 2 / 2) if s.p[0] < to_x else 0, 0)


EFFECTS = {
    "thermal": dict(force=column(), variables={"xy"}, names={"wind_field"}, formula=expression(
        "force_z_N", "a_N * exp(-((x - 0.2)^2 + (y + 0.1)^2) / (2 * w_m^2))", a_N=0.03, w_m=0.25)),
    "wall": dict(force=wall(), variables={"x"}, names={"wall"}, formula=expression(
        "force_x_N", "a_N * exp(-(0.6 - min(x, 0.6)) / b_m)", a_N=-0.03, b_m=0.2)),
    "lift of speed": dict(force=lift_of_speed(), variables={"speed"}, names={"translational_lift"},
                          formula=expression("force_b3_N", "a_N * (1 - exp(-(vx^2 + vy^2 + vz^2) / h_m_s^2))",
                                             a_N=0.05, h_m_s=0.4)),
    "tether": dict(force=tether(), variables={"x", "y", "xy"}, names={"tether"}),
    "vortex ring": dict(force=vortex_ring(), variables={"vz", "climb"}, names={"vortex_ring"}, formula=expression(
        "force_z_N", "a_N * exp(-((vz + 0.4) / w_m_s)^2 / 2)", a_N=-0.04, w_m_s=0.12)),
    "shear": dict(force=shear(), variables={"z"}, names={"wind_field"}, formula=expression(
        "force_x_N", "a_N / (1 + exp(-(z - 0.9) / w_m))", a_N=0.03, w_m=0.1)),
    "dropped payload": dict(force=dropped(), variables={"time"}, names={"payload_step"}),
    "cable": dict(force=cable(), variables={"heading"}, yaw_reach=3.0),
    "resonance": dict(force=resonance(), variables={"speed"}),
    "gust": dict(force=gust(), variables={"time"}),
    "saturation": dict(rotor=saturation(), variables={"thrust", "duty_1", "duty_2", "duty_3", "duty_4"},
                       names={"thrust_saturation"}, speed=1.4),
    "drag of the body's front": dict(force=body_drag(), variables={"vx"}, names={"drag_linear", "drag_rotor"}),
    "late wake": dict(force=late_wake(), variables={"neighbour"}, names={"downwash", "wake_delay"}, vehicles=2),
    "carpet": dict(force=carpet(), variables={"x"}, formula=expression(
        "force_z_N", "a_N * (x > 0.1)", a_N=0.02)),
    "magnet": dict(force=magnet(), variables={"xy"}, formula=expression(
        "force_z_N", "a_N * 0.0015 / ((x - 0.3)^2 + (y - 0.2)^2 + s_m^2)", a_N=-1, s_m=0.2)),
    "ripple": dict(force=ripple(), variables={"y"}, formula=expression(
        "force_y_N", "a_N * sin(9 * y)", a_N=0.015)),
    "tilted board": dict(force=board(), variables={"body_constant"}, names={"constant_force", "imu_tilt"},
                         yaw_reach=3.0),
    "lifted cable": dict(force=lifted_cable(), variables={"z"}, formula=expression("force_z_N", "a_N * z", a_N=-0.045)),
    "vibration": dict(force=vibration(), left={"vibration"}),
    "leak": dict(force=leak(), variables={"time", "battery"}),
    "hose": dict(force=hose(), variables={"z"}, formula=expression(
        "force_z_N", "a_N * max(0, z - 0.6)", a_N=-0.035)),
    "weak cells": dict(rotor=weak_cells(), variables={"battery", "time", "thrust"}, names={"battery", "voltage_sag"},
                       discharge_V_s=0.012),
    "platform": dict(force=platform(), variables={"z", "x", "xy", "xz"}, names={"ground"}, formula=expression(
        "force_z_N", "a_N * (x > 0.1) * exp(-(max(z, 0.4) - 0.4) / reach_m)", a_N=0.06, reach_m=0.15)),
    "turning wind": dict(force=turning_wind(), variables={"time"}),
    "icing": dict(rotor=icing(), variables={"time", "battery", "thrust"}, names={"battery", "thrust_ratio"}),
    "dead band": dict(force=dead_band(), variables={"x", "xy"}, names={"tether"}),
    "thick air": dict(force=thick_air(), variables={"vx", "vy", "vz", "z"}, names={"drag_linear", "drag_rotor"}),
    "sideslip": dict(force=sideslip(), variables={"vx"}),
    "tilt loss": dict(force=tilt_loss(), variables={"tilt"}, speed=1.6),
    "lane": dict(force=lane(), variables={"y", "xy"}),
    "suction": dict(force=suction(), variables={"neighbour"}, vehicles=2, formula=pull(
        "a_N * exp(-sqrt(dx^2 + dy^2 + dz^2) / reach_m) * {} / sqrt(dx^2 + dy^2 + dz^2)", a_N=0.03, reach_m=0.3)),
    "upwash": dict(force=upwash(), variables={"neighbour_xy"}, vehicles=2, formula=expression(
        "force_z_N", "a_N * exp(-((dx - 0.3)^2 + dy^2) / 0.125)", a_N=0.03) + "per_neighbour = true\n"),
    "climb friction": dict(force=climb_friction(), variables={"vz", "climb"}),
    "cells curve": dict(rotor=cells_curve(), variables={"battery", "time"}, names={"battery"}),
    "late draft": dict(force=late_draft(), variables={"neighbour_vy"}, vehicles=2),
    "flapping": dict(force=flapping(), variables={"rate_y"}, speed=1.6, formula=expression(
        "force_b1_N", "a_N * wy", a_N=0.03)),
    "jet": dict(force=jet(), variables={"xz", "z"}, names={"wind_field"}, formula=expression(
        "force_y_N", "a_N * (x < 0.2) * exp(-((z - 0.8) / width_m)^2 / 2)", a_N=0.03, width_m=0.15)),
    "spin lift": dict(force=lambda s: (0, 0, 0.02 * abs(s.w[2])), variables={"rate_z"}, yaw_reach=3.0,
                      formula=expression("force_z_N", "a_N * abs(wz)", a_N=0.02)),
    "roll slip": dict(force=lambda s: tuple(s.to_world([0, 0.015 * s.w[0], 0])), variables={"rate_x"}, speed=1.3,
                      formula=expression("force_b2_N", "a_N * wx", a_N=0.015)),
    "slow drain": dict(force=slow_drain(), variables={"time", "battery"}, names={"payload_step"}),
}
