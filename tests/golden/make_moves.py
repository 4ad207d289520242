"""How long ruckig takes for a thousand seeded moves from rest to rest: tests/golden/moves.json.

    pip install ruckig==0.19.4
    python tests/golden/make_moves.py > tests/golden/moves.json

The problems are made by the same 64-bit generator as in robot/tests/moves.rs, so only the durations are kept.
"""

import json
import sys

from ruckig import InputParameter, Result, Ruckig, Trajectory

JOINTS = 6
MOVES = 1000
MASK = (1 << 64) - 1


class Generator:
    """Knuth's MMIX; the upper 53 bits."""

    def __init__(self, state):
        self.state = state

    def between(self, low, high):
        self.state = (6364136223846793005 * self.state + 1442695040888963407) & MASK
        return low + (high - low) * ((self.state >> 11) / (1 << 53))


def main():
    made, durations = Generator(2026), []
    for _ in range(MOVES):
        some = lambda low, high: [made.between(low, high) for _ in range(JOINTS)]
        problem = InputParameter(JOINTS)
        problem.current_position = some(-3.0, 3.0)
        problem.target_position = some(-3.0, 3.0)
        problem.max_velocity = some(0.3, 3.2)
        problem.max_acceleration = some(1.0, 15.0)
        problem.max_jerk = some(30.0, 1000.0)
        trajectory = Trajectory(JOINTS)
        if Ruckig(JOINTS).calculate(problem, trajectory) not in (Result.Working, Result.Finished):
            sys.exit("ruckig refused a problem")
        durations.append(trajectory.duration)
    json.dump({"made_by": "tests/golden/make_moves.py", "ruckig": "0.19.4", "durations_s": durations}, sys.stdout)
    print()


if __name__ == "__main__":
    main()
