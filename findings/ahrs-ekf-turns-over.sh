#!/usr/bin/env bash
# ahrs 0.4.0: in the frame ENU the Kalman filter turns a resting sensor upside down
#
# Expected: `EKF(frame="ENU")` fed with an accelerometer that reads 9.81 m/s^2 upwards at rest, which is g_ENU of its
# documentation ([0, 0, 9.81]), keeps the attitude of a sensor that lies still.
# What happens: the first attitude is formed from such a reading and is right. The update then compares with
# [0, 0, -1] (NED: [0, 0, 1], the documentation's sign reversed as well). The right attitude is an unstable point; a
# little noise, and in some twenty seconds the sensor has turned by 180 degrees. With the accelerometer negated the
# start is wrong and the end right, after a minute. In NED the same reading as documented is upside down throughout.
# Documented: the other sign, for both frames.
# Why it matters: ENU with the specific force is what ROS messages and most sensors deliver. A short recording of a
# tool looks right, a long one is a slow turn of a tool that lay on the table.
# Instead: NED, with the accelerometer negated; or Mahony, which takes ENU as it comes.
#
# 100 Hz, noise of 0.02 m/s^2, 0.002 rad/s and 0.4 % of the field; the true attitude is yaw 40, pitch 10, roll 20 deg.
#
# Seen:
#   after 0 s, 5 s, 10 s, 20 s, 60 s
#   EKF ENU, upwards at rest error   0.7,  38.2, 115.4, 176.4, 180.0 deg
#   EKF ENU, negated         error 179.8, 174.6, 169.4, 148.2,   2.4 deg
#   EKF NED, upwards at rest error 179.9, 180.0, 180.0, 180.0, 180.0 deg
#   EKF NED, negated         error   0.2,   0.0,   0.0,   0.0,   0.0 deg
#   Mahony, upwards at rest  error   0.7,   0.1,   0.3,   0.1,   0.0 deg
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet ahrs==0.4.0 numpy==2.4.6 scipy==1.17.1

venv/bin/python - <<'PYTHON'
import numpy as np
from ahrs.filters import EKF, Mahony
from scipy.spatial.transform import Rotation

SAMPLES, RATE_HZ, DIP_DEG = 6001, 100, 60.0
AT_S = (0, 5, 10, 20, 60)
ATTITUDE = Rotation.from_euler("ZYX", [40, 10, 20], degrees=True)
NORTH, DOWN = np.cos(np.radians(DIP_DEG)), np.sin(np.radians(DIP_DEG))
UP = {"ENU": np.array([0, 0, 1.0]), "NED": np.array([0, 0, -1.0])}
FIELD = {"ENU": np.array([0, NORTH, -DOWN]), "NED": np.array([NORTH, 0, DOWN])}


def still_sensor(frame, sign):
    """Readings of a sensor at rest; with sign +1 the accelerometer measures the specific force, upwards."""
    noise = np.random.default_rng(0).normal(size=(3, SAMPLES, 3))
    return {
        "gyr": 0.002 * noise[0],
        "acc": ATTITUDE.inv().apply(sign * 9.81 * UP[frame]) + 0.02 * noise[1],
        "mag": 50 * ATTITUDE.inv().apply(FIELD[frame]) + 0.2 * noise[2],
    }


def error_deg(quaternions):
    """Angle between the estimated attitude and the true one, at the times told."""
    estimated = Rotation.from_quat(quaternions[[at * RATE_HZ for at in AT_S]][:, [1, 2, 3, 0]])
    return np.degrees((ATTITUDE.inv() * estimated).magnitude())


def told(name, errors):
    print(f"{name:24s} error " + ", ".join(f"{e:5.1f}" for e in errors) + " deg")
    return errors


print("after " + ", ".join(f"{at} s" for at in AT_S))
seen = {}
for frame in UP:
    for sign, name in {1: "upwards at rest", -1: "negated"}.items():
        kalman = EKF(**still_sensor(frame, sign), frequency=RATE_HZ, frame=frame, magnetic_ref=DIP_DEG)
        seen[frame, sign] = told(f"EKF {frame}, {name}", error_deg(kalman.Q))
told("Mahony, upwards at rest", error_deg(Mahony(**still_sensor("ENU", 1), frequency=RATE_HZ).Q))

if seen["ENU", 1][-1] < 5:
    raise SystemExit("changed: the filter keeps the attitude in ENU")
if seen["ENU", 1][0] > 5 or seen["ENU", 1][-1] < 170 or seen["NED", -1].max() > 5 or seen["NED", 1].min() < 170:
    raise SystemExit("changed: the filter takes the sign of the accelerometer in another way")
PYTHON
