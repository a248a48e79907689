"""A quadrotor simulator for tests of `diagnose` and `add` in plain Python, which shares no code with the tool.

Rigid body with four first-order rotors, position and attitude control at 500 Hz, forces and torques as any Python
function of the state. Sensors: an accelerometer with a two-pole low-pass of 30 Hz in the body frame, noise, a clock
with skew and offset, and the quantisation of the log's integers. Logs are binary "old uSD" files.
"""

import math
import os
import random
import struct
import zlib

GRAVITY = 9.81
MASS_KG = 0.034
INERTIA = (16.57e-6, 16.66e-6, 29.26e-6)
ARM_M = 0.046 * math.sqrt(0.5)
TORQUE_PER_THRUST_M = 0.006
STEP_S = 0.002
LOG_EVERY = 5
ROTOR_LAG_S = 0.05

# Load-cell map of one rotor in gram-force: p = PWM / 65536, v = V / 4.2.
C00, C10, C01 = 11.093358483549203, -39.08104165843915, -9.525647087583181
C20, C11 = 20.573302305476638, 38.42885066644033


def rotor_N(duty, battery_V):
    v = battery_V / 4.2
    return 1e-3 * GRAVITY * (C00 + C01 * v + duty * (C10 + C11 * v + C20 * duty))


def duty_for(force_N, battery_V):
    v = battery_V / 4.2
    b = C10 + C11 * v
    c = C00 + C01 * v - force_N / (1e-3 * GRAVITY)
    return min(max((-b + math.sqrt(max(b * b - 4 * C20 * c, 0.0))) / (2 * C20), 0.0), 1.0)


class Wave:
    """A sum of three sines with amplitude at most 1, and its derivatives."""

    def __init__(self, rng, lowest_hz, highest_hz):
        self.parts = [(size, 2 * math.pi * rng.uniform(lowest_hz, highest_hz), rng.uniform(0, 2 * math.pi))
                      for size in (0.5, 0.3, 0.2)]

    def at(self, t):
        value = slope = bend = 0.0
        for size, omega, phase in self.parts:
            s, c = math.sin(omega * t + phase), math.cos(omega * t + phase)
            value += size * s
            slope += size * omega * c
            bend -= size * omega * omega * s
        return value, slope, bend


class Path:
    """Setpoints: waves around a centre, which begin after a second at rest."""

    def __init__(self, rng, centre, reach, fastest_hz, yaw_reach):
        self.centre, self.reach = centre, reach
        self.waves = [Wave(rng, 0.06, fastest_hz) for _ in range(3)]
        self.yaw_reach, self.yaw = yaw_reach, Wave(rng, 0.02, 0.06)

    def at(self, t):
        since = max(t - 1, 0.0)
        s, ds, dds = (since * since / 2, since, 1.0 if since > 0 else 0.0) if since < 1 else (since - 0.5, 1.0, 0.0)
        p, v, a = [], [], []
        for axis in range(3):
            w = self.waves[axis].at(s)
            p.append(self.centre[axis] + self.reach[axis] * w[0])
            v.append(self.reach[axis] * w[1] * ds)
            a.append(self.reach[axis] * (w[2] * ds * ds + w[1] * dds))
        return p, v, a, self.yaw_reach * self.yaw.at(s)[0]


class State:
    """The variables on which hidden effects may depend: the truth, not sensor values."""

    def __init__(self, p):
        self.t = 0.0
        self.p, self.v = list(p), [0.0, 0.0, 0.0]
        self.q, self.w = [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        self.rotors = [MASS_KG * GRAVITY / 4] * 4
        self.thrust = MASS_KG * GRAVITY
        self.battery = 4.15
        self.R = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        self.others = []  # positions of the other vehicles, now and in the past: others[j](seconds ago)
        self.memory = {}  # of effects with memory; `a` is that of the last step
        self.a = [0.0, 0.0, 0.0]

    @property
    def speed(self):
        return math.sqrt(sum(x * x for x in self.v))

    @property
    def heading(self):
        return math.atan2(self.R[1][0], self.R[0][0])

    def to_body(self, u):
        return [sum(self.R[k][i] * u[k] for k in range(3)) for i in range(3)]

    def to_world(self, u):
        return [sum(self.R[i][k] * u[k] for k in range(3)) for i in range(3)]


def rotation(q):
    w, x, y, z = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


class Sensors:
    def __init__(self, rng):
        self.rng = rng
        self.late_s, self.skew = rng.uniform(0, 0.03), rng.uniform(-1e-4, 1e-4)
        self.ahead_s, self.from_s = 0.0, 0.0  # of the clock; when the log begins
        self.velocity_scale, self.heading_rad = 1.0, 0.0  # faults of the estimates
        self.y, self.dy = None, [0.0, 0.0, 0.0]
        self.records = []

    def feel(self, specific_B):
        """A two-pole Butterworth low-pass at 30 Hz, in four sub-steps."""
        if self.y is None:
            self.y = list(specific_B)
        w, h = 2 * math.pi * 30, STEP_S / 4
        for i in range(3):
            y, dy, u = self.y[i], self.dy[i], specific_B[i]
            for _ in range(4):
                dy += h * (w * w * (u - y) - math.sqrt(2) * w * dy)
                y += h * dy
            self.y[i], self.dy[i] = y, dy

    def log(self, state, target, duties, commanded_N):
        noise = self.rng.gauss
        if state.t < self.from_s:
            return
        tick = int(1e6 * ((state.t + self.ahead_s - self.late_s) * (1 + self.skew)) + noise(0, 60))
        if tick < 0:
            return
        a = turned(state.to_world([self.y[i] + noise(0, 0.1) for i in range(3)]), self.heading_rad)
        values = [tick]
        values += [milli(x + noise(0, 2e-4)) for x in state.p]
        values += [milli(self.velocity_scale * x + noise(0, 4e-3)) for x in state.v]
        values += [milli(x) for x in a] + [compressed(turned_attitude(state.q, self.heading_rad))]
        values += [milli(x) for x in state.w]
        values += [milli(x) for x in target[0]] + [milli(x) for x in target[1]]
        values += [commanded_N, 0.0, 0.0, 0.0] + [commanded_N / 4] * 4
        values += [int(65535 * d + 0.5) for d in duties] + [20.0, int(1000 * state.battery + 0.5), 0.0]
        self.records.append(struct.pack(RECORD, *values))


VARIABLES = ("tick(I) stateEstimateZ.x(h) stateEstimateZ.y(h) stateEstimateZ.z(h) stateEstimateZ.vx(h) "
             "stateEstimateZ.vy(h) stateEstimateZ.vz(h) stateEstimateZ.ax(h) stateEstimateZ.ay(h) "
             "stateEstimateZ.az(h) stateEstimateZ.quat(I) stateEstimateZ.rateRoll(h) stateEstimateZ.ratePitch(h) "
             "stateEstimateZ.rateYaw(h) ctrltargetZ.x(h) ctrltargetZ.y(h) ctrltargetZ.z(h) ctrltargetZ.vx(h) "
             "ctrltargetZ.vy(h) ctrltargetZ.vz(h) motor.thrust(f) motor.torquex(f) motor.torquey(f) "
             "motor.torquez(f) motor.f1(f) motor.f2(f) motor.f3(f) motor.f4(f) pwm.m1_pwm(I) pwm.m2_pwm(I) "
             "pwm.m3_pwm(I) pwm.m4_pwm(I) pwm.maxThrust(f) pm.vbatMV(H) ctrlFa.Faz(f)").split()
RECORD = "<" + "".join(name[-2] for name in VARIABLES)


def milli(value):
    return max(-32768, min(32767, int(value * 1000)))


def turned(u, heading_rad):
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    return [c * u[0] - s * u[1], s * u[0] + c * u[1], u[2]]


def turned_attitude(q, heading_rad):
    c, s = math.cos(heading_rad / 2), math.sin(heading_rad / 2)
    return [c * q[0] - s * q[3], c * q[1] - s * q[2], c * q[2] + s * q[1], c * q[3] + s * q[0]]


def compressed(q):
    """The firmware's 32-bit quaternion: index of the largest component, then sign and nine bits of each other one."""
    parts = [q[1], q[2], q[3], q[0]]
    largest = max(range(4), key=lambda i: abs(parts[i]))
    negate = parts[largest] < 0
    bits = largest
    for i in range(4):
        if i != largest:
            size = min(int(511 * abs(parts[i]) / math.sqrt(0.5) + 0.5), 511)
            bits = bits << 10 | ((parts[i] < 0) != negate) << 9 | size
    return bits


def usd_file(records):
    def checked(data):
        return data + struct.pack("<I", ~zlib.crc32(data) & 0xFFFFFFFF)

    text = bytes([len(VARIABLES)]) + "".join(name + "," for name in VARIABLES).encode()
    blocks = [checked(bytes([len(records[i:i + 2])]) + b"".join(records[i:i + 2])) for i in range(0, len(records), 2)]
    return checked(text) + b"".join(blocks)


class Vehicle:
    def __init__(self, rng, path):
        self.path, self.sensors = path, Sensors(rng)
        self.state = State(path.at(0)[0])
        self.integral = [0.0, 0.0, 0.0]
        self.duties = [0.5] * 4
        self.commanded_N = MASS_KG * GRAVITY
        self.past = []

    def control(self, target):
        """PID control of the position, PD control of the attitude, mixed to four rotors."""
        s = self.state
        p, v, a, yaw = target
        noise = self.sensors.rng.gauss
        wanted = []
        for i in range(3):
            ep = p[i] - s.p[i] + noise(0, 1e-4)
            ev = v[i] - s.v[i] + noise(0, 3e-3)
            self.integral[i] = max(-0.3, min(0.3, self.integral[i] + STEP_S * ep))
            wanted.append(MASS_KG * (a[i] + (GRAVITY if i == 2 else 0) + 16 * ep + 6 * ev + 5 * self.integral[i]))
        b3 = [s.R[0][2], s.R[1][2], s.R[2][2]]
        self.commanded_N = max(0.1, min(0.55, sum(wanted[i] * b3[i] for i in range(3))))
        length = math.sqrt(sum(x * x for x in wanted))
        in_body = s.to_body([x / length for x in wanted])
        error = [-in_body[1], in_body[0], wrapped(yaw - s.heading)]  # rotation from b3 to the desired axis
        torque = [INERTIA[0] * (400 * error[0] - 30 * s.w[0]), INERTIA[1] * (400 * error[1] - 30 * s.w[1]),
                  INERTIA[2] * (60 * error[2] - 15 * s.w[2])]
        f, x, y, z = (self.commanded_N / 4, torque[0] / (4 * ARM_M), torque[1] / (4 * ARM_M),
                      torque[2] / (4 * TORQUE_PER_THRUST_M))
        rotors = [f - x - y - z, f - x + y + z, f + x + y - z, f + x - y + z]
        self.duties = [duty_for(max(r, 0.0), s.battery) for r in rotors]

    def advance(self, truth):
        s = self.state
        share = 1 - math.exp(-STEP_S / ROTOR_LAG_S)
        force_of_rotor = truth.get("rotor", lambda state, index, thrust_N: thrust_N)
        for k in range(4):
            s.rotors[k] += share * (rotor_N(self.duties[k], s.battery) - s.rotors[k])
        lifts = [force_of_rotor(s, k, s.rotors[k]) for k in range(4)]
        s.thrust = sum(lifts)
        push = truth["force"](s) if "force" in truth else (0.0, 0.0, 0.0)
        twist = truth["torque"](s) if "torque" in truth else (0.0, 0.0, 0.0)
        felt = [push[i] + s.R[i][2] * s.thrust for i in range(3)]
        m = MASS_KG
        specific = [x / m for x in felt]
        s.a = [specific[0], specific[1], specific[2] - GRAVITY]
        self.sensors.feel(s.to_body([truth.get("accelerometer_scale", 1.0) * x for x in specific]))
        for i in range(3):
            s.v[i] += STEP_S * s.a[i]
            s.p[i] += STEP_S * s.v[i]
        torque = [ARM_M * (lifts[2] + lifts[3] - lifts[0] - lifts[1]) + twist[0],
                  ARM_M * (lifts[1] + lifts[2] - lifts[0] - lifts[3]) + twist[1],
                  TORQUE_PER_THRUST_M * (lifts[1] + lifts[3] - lifts[0] - lifts[2]) + twist[2]]
        w = s.w
        gyro = [w[1] * INERTIA[2] * w[2] - w[2] * INERTIA[1] * w[1],
                w[2] * INERTIA[0] * w[0] - w[0] * INERTIA[2] * w[2],
                w[0] * INERTIA[1] * w[1] - w[1] * INERTIA[0] * w[0]]
        for i in range(3):
            w[i] += STEP_S * (torque[i] - gyro[i]) / INERTIA[i]
        q0, q1, q2, q3 = s.q
        h = STEP_S / 2
        q = [q0 - h * (q1 * w[0] + q2 * w[1] + q3 * w[2]), q1 + h * (q0 * w[0] + q2 * w[2] - q3 * w[1]),
             q2 + h * (q0 * w[1] - q1 * w[2] + q3 * w[0]), q3 + h * (q0 * w[2] + q1 * w[1] - q2 * w[0])]
        length = math.sqrt(sum(x * x for x in q))
        s.q = [x / length for x in q]
        s.R = rotation(s.q)
        s.battery = 4.15 - truth.get("discharge_V_s", 0.006) * s.t - 0.5 * (s.thrust - 0.33)
        s.t += STEP_S
        self.past.append(tuple(s.p))


def wrapped(angle):
    return math.atan2(math.sin(angle), math.cos(angle))


def fly(truth, seed, folder, run=0, vehicles=1, duration_s=30.0):
    """Simulates a flight and writes folder/cf<1 ...>_<run>. `truth`: force(state) in the world, torque(state) in the
    body, both in SI units; rotor(state, index, thrust_N), what a rotor gives; discharge_V_s; accelerometer_scale;
    velocity_scale; heading_rad, by which attitudes and accelerations are turned about the vertical; clocks_s, by how
    much each log's clock is ahead; from_s, when the logs begin; apart_m, how far the others' paths are to the side.
    Returns how far the clock of each log is truly ahead, s."""
    rng = random.Random(seed * 1000 + run)
    scale = truth.get("speed", 1.0)
    fleet = []
    first = Path(rng, (0.0, 0.0, 0.9), (0.8, 0.8, 0.5), 0.28 * scale, truth.get("yaw_reach", 2.0))
    for k in range(vehicles):
        path = first
        if k > 0:  # moves around the first one, below and above it
            path = Path(rng, (0.0, 0.0, 0.9), (0.8, 0.8, 0.55), 0.28 * scale, 1.0)
            path.waves[0], path.waves[1] = first.waves[0], first.waves[1]
            path = Around(path, Wave(rng, 0.1, 0.4), Wave(rng, 0.1, 0.4), truth.get("apart_m", 0.0))
        fleet.append(Vehicle(random.Random(seed * 77 + run * 13 + k), path))
    for k, vehicle in enumerate(fleet):
        vehicle.sensors.ahead_s = truth.get("clocks_s", (0.0,) * vehicles)[k]
        vehicle.sensors.from_s = truth.get("from_s", 0.0)
        vehicle.sensors.velocity_scale = truth.get("velocity_scale", 1.0)
        vehicle.sensors.heading_rad = truth.get("heading_rad", 0.0)
        vehicle.state.others = [ago(other) for j, other in enumerate(fleet) if j != k]
    for step in range(int(duration_s / STEP_S)):
        targets = [vehicle.path.at(vehicle.state.t) for vehicle in fleet]
        for vehicle, target in zip(fleet, targets):
            vehicle.control(target)
        for vehicle, target in zip(fleet, targets):
            vehicle.advance(truth)
            if step % LOG_EVERY == 0:
                vehicle.sensors.log(vehicle.state, target, vehicle.duties, vehicle.commanded_N)
    os.makedirs(folder, exist_ok=True)
    for k, vehicle in enumerate(fleet):
        with open(os.path.join(folder, f"cf{k + 1}_{run:02d}"), "wb") as file:
            file.write(usd_file(vehicle.sensors.records))
    return [vehicle.sensors.ahead_s - vehicle.sensors.late_s for vehicle in fleet]


class Around:
    """A path with two more lateral waves, about a centre that is offset in x."""

    def __init__(self, path, x, y, apart_m):
        self.path, self.more, self.apart_m = path, (x, y), apart_m

    def at(self, t):
        p, v, a, yaw = self.path.at(t)
        p[0] += self.apart_m
        since = max(t - 1, 0.0)
        s, ds, dds = (since * since / 2, since, 1.0 if since > 0 else 0.0) if since < 1 else (since - 0.5, 1.0, 0.0)
        for axis, wave in enumerate(self.more):
            w = wave.at(s)
            p[axis] += 0.3 * w[0]
            v[axis] += 0.3 * w[1] * ds
            a[axis] += 0.3 * (w[2] * ds * ds + w[1] * dds)
        return p, v, a, yaw


def ago(vehicle):
    def position(seconds):
        back = int(seconds / STEP_S + 0.5)
        return vehicle.past[max(len(vehicle.past) - 1 - back, 0)] if vehicle.past else tuple(vehicle.state.p)
    return position
