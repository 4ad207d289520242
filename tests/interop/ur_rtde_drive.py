"""PyPI's ur_rtde, unmodified, drives the simulated controller: Receive, Control, IO and Dashboard.

usage: ur_rtde_drive.py HOST FACTS.json    (facts: what our own model says, and what the arm carries)

Everything is judged by what the client reads back; waiting has an end, and is generous: the machine may be loaded.
"""

import json
import math
import sys
import time

import dashboard_client
import rtde_control
import rtde_io
import rtde_receive

HOST = sys.argv[1]
with open(sys.argv[2]) as file:
    FACTS = json.load(file)
PATIENCE_S = 90.0


def again(what, make):
    """ur_rtde has deadlines of its own (5 s) that a loaded machine may miss: another try, said aloud."""
    for attempt in range(5):
        try:
            return make()
        except Exception as error:  # noqa: BLE001 (its exceptions have no common base)
            print(f"{what}: try {attempt + 1}: {error}")
            time.sleep(1.0)
    raise AssertionError(f"{what} never came up")


def until(what, is_so):
    end = time.time() + PATIENCE_S
    while time.time() < end:
        if is_so():
            return
        time.sleep(0.01)
    raise AssertionError(f"not so after {PATIENCE_S} s: {what}")


def apart(a, b):
    return max(abs(x - y) for x, y in zip(a, b))


def near(what, a, b, within):
    assert apart(a, b) < within, f"{what}: {a} is not {b} within {within}"


def mean_force(receive, count=200):
    """Over `count` different instants of the controller's clock."""
    total, seen, last = [0.0] * 6, 0, None
    end = time.time() + PATIENCE_S
    while seen < count and time.time() < end:
        stamp = receive.getTimestamp()
        if stamp != last:
            last, seen = stamp, seen + 1
            total = [t + f for t, f in zip(total, receive.getActualTCPForce())]
        time.sleep(0.001)
    assert seen == count
    return [t / count for t in total]


receive = again("receive", lambda: rtde_receive.RTDEReceiveInterface(HOST))
slow = again("receive at 125 Hz", lambda: rtde_receive.RTDEReceiveInterface(HOST, 125.0))
dashboard = dashboard_client.DashboardClient(HOST)
again("dashboard", lambda: dashboard.connect(10000))
control = again("control", lambda: rtde_control.RTDEControlInterface(HOST))

# Dashboard.
assert dashboard.robotmode() == "Robotmode: RUNNING" and dashboard.running()
assert dashboard.polyscopeVersion().startswith("5.") and dashboard.isInRemoteControl()
assert dashboard.getSerialNumber().isdigit() and "PLAYING" in dashboard.programState()
assert dashboard.safetystatus() == "Safetystatus: NORMAL"

# Receive.
start = receive.getActualQ()
assert receive.getTimestamp() > 40.0 and receive.getRobotMode() == 7 and receive.getSafetyMode() == 1
assert receive.getRuntimeState() == 2 and receive.getRobotStatus() & 3 == 3
near("two clients read one arm", slow.getActualQ(), start, 1e-3)

# moveJ, forward and inverse kinematics, against our own model.
for case in FACTS["cases"]:
    assert control.moveJ(case["q"], 1.0, 1.4)
    until("the arm arrived", lambda: apart(receive.getActualQ(), case["q"]) < 1e-3)
    near("flange pose", receive.getActualTCPPose(), case["flange"], 1e-3)
    near("forward kinematics", control.getForwardKinematics(), case["flange"], 1e-3)
    near("inverse kinematics", control.getInverseKinematics(case["flange"], case["q"]), case["q"], 1e-4)
assert control.moveJ(start, 1.0, 1.4)

# The tool, its weight, the force sensor.
assert control.setTcp(FACTS["tcp"])
near("tcp", control.getTCPOffset(), FACTS["tcp"], 1e-9)
assert control.setPayload(0.0, [0.0, 0.0, 0.001])
time.sleep(0.2)
weight = mean_force(receive)
assert abs(weight[2] + FACTS["mass_kg"] * 9.80665) < 0.1, f"without a payload the weight shows: {weight}"
assert control.setPayload(FACTS["mass_kg"], FACTS["centre_m"])
time.sleep(0.2)
assert control.zeroFtSensor()
time.sleep(0.2)
quiet = mean_force(receive)
assert max(abs(f) for f in quiet[:3]) < 0.1, f"in the air nothing is left: {quiet}"

# moveL, straight down to above the leg.
above = receive.getActualTCPPose()
above[2] -= FACTS["down_m"]
assert control.moveL(above, 0.2, 0.8)
until("the tool arrived", lambda: apart(receive.getActualTCPPose()[:3], above[:3]) < 1e-3)

# servoJ: a slow wave of joint 0, which ends where it began.
wave = receive.getTargetQ()
middle = wave[0]
for cycle in range(500):
    period = control.initPeriod()
    wave[0] = middle + 0.03 * math.sin(2.0 * math.pi * cycle / 500)
    assert control.servoJ(wave, 0.0, 0.0, 0.002, 0.1, 300)
    control.waitPeriod(period)
wave[0] = middle
control.servoJ(wave, 0.0, 0.0, 0.002, 0.1, 300)
until("servoJ ended where it was told", lambda: apart(receive.getActualQ(), wave) < 1e-3)
control.servoStop()

# speedL and its end.
speed = [0.0, 0.02, 0.0, 0.0, 0.0, 0.0]
assert control.speedL(speed, 0.5, 0.0)
until("speedL reached its speed", lambda: apart(receive.getActualTCPSpeed()[:3], speed[:3]) < 2e-3)
control.speedStop()
until("speedL stopped", lambda: max(abs(v) for v in receive.getActualQd()) < 5e-3)
assert control.moveL(above, 0.2, 0.8)

# forceMode presses the leg with the wrench that was asked.
asked = FACTS["press_n"]
control.forceModeSetDamping(0.025)
control.forceMode([0.0] * 6, [0, 0, 1, 0, 0, 0], [0.0, 0.0, -asked, 0.0, 0.0, 0.0], 2, [0.1, 0.1, 0.1, 0.5, 0.5, 0.5])
until("the probe touches", lambda: receive.getActualTCPForce()[2] > 0.6 * asked)
touched = receive.getTimestamp()
until("it settled", lambda: receive.getTimestamp() > touched + 6.0)
pressed = mean_force(receive)
assert abs(pressed[2] - asked) < 0.2, f"asked for {asked} N, pressed with {pressed}"
print(json.dumps({"pressed_n": pressed[2], "at_s": receive.getTimestamp()}))
control.forceModeStop()
assert control.moveL(above, 0.1, 0.5)
assert control.moveJ(start, 1.0, 1.4)

# Hand guiding, both ways: the simulated hand takes the probe.
for begin, end in [
    (control.teachMode, control.endTeachMode),
    (lambda: control.freedriveMode([1, 1, 1, 1, 1, 1], [0.0] * 6), control.endFreedriveMode),
]:
    here = receive.getActualQ()
    assert begin()
    until("the teach button is held", lambda: receive.getRobotStatus() & 4)
    until("the hand leads the arm", lambda: apart(receive.getActualQ(), here) > 0.02)
    assert end()
    until("it is let go", lambda: not receive.getRobotStatus() & 4)
    until("it rests", lambda: max(abs(v) for v in receive.getActualQd()) < 5e-3)
assert control.moveJ(start, 1.0, 1.4)

# A move that nobody waits for, stopped on its way.
away = list(start)
away[0] += 0.5
assert control.moveJ(away, 0.3, 1.0, True)
until("it moves", lambda: abs(receive.getActualQ()[0] - start[0]) > 0.02)
control.stopJ(4.0)
until("it stopped", lambda: max(abs(v) for v in receive.getActualQd()) < 5e-3)
assert abs(receive.getActualQ()[0] - away[0]) > 0.1
assert control.moveJ(start, 1.0, 1.4)

# IO.
io = again("io", lambda: rtde_io.RTDEIOInterface(HOST))
assert io.setStandardDigitalOut(3, True) and io.setSpeedSlider(0.5)
until("the output and the slider are set", lambda: receive.getDigitalOutState(3) and receive.getSpeedScaling() == 0.5)
assert io.setSpeedSlider(1.0)
until("the slider is back", lambda: receive.getSpeedScaling() == 1.0)

# A protective stop: the move fails; unlocked and uploaded again, it succeeds.
assert control.triggerProtectiveStop()
until("it stopped by itself", lambda: receive.isProtectiveStopped() and receive.getSafetyStatusBits() == 1028)
assert receive.getSafetyMode() == 3 and not control.isProgramRunning()
assert control.moveJ(away, 1.0, 1.4) is False


def unlocked():
    try:
        dashboard.unlockProtectiveStop()
        return True
    except Exception as error:  # noqa: BLE001
        assert "5s" in str(error), error
        return False


until("it lets itself be unlocked", unlocked)
dashboard.closeSafetyPopup()
assert control.reuploadScript()
until("the script runs again", control.isProgramRunning)
assert control.moveJ(away, 1.0, 1.4)
until("the arm arrived", lambda: apart(receive.getActualQ(), away) < 1e-3)

# The watchdog: fed, the program runs; hungry, it ends, and the arm with it.
assert control.setWatchdog(1.0)
fed = receive.getTimestamp()
while receive.getTimestamp() < fed + 3.0:
    assert control.kickWatchdog()
    time.sleep(0.02)
assert control.isProgramRunning()
assert control.moveJ(start, 0.1, 0.5, True)
until("the watchdog ended the program", lambda: not control.isProgramRunning())
until("the arm rests", lambda: max(abs(v) for v in receive.getActualQd()) < 5e-3)
assert apart(receive.getActualQ(), start) > 0.01, "it stopped on its way"

# Reconnecting.
receive.disconnect()
assert not receive.isConnected()
assert receive.reconnect() and receive.isConnected()
control.disconnect()
print("ur_rtde drove it")
