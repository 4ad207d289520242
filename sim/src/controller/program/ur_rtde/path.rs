//! The path that ur_rtde writes into its script for `moveJ(path)` and `moveL(path)`.

use probepath_robot::Joints;

use crate::controller::pose;
use crate::controller::robot::{Robot, Wish};

/// Steps of a path that are kept; an honest one has hundreds.
const MOST: usize = 10_000;

/// One `movej(...)` or `movel(...)` with numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PathStep {
    straight: bool,
    /// `p[...]`: a place of the tool; else joints.
    place: bool,
    target: [f64; 6],
    speed: f64,
    acceleration: f64,
}

/// The steps between `def exec_move_path():` and its `end`. What is no such step is not there: blends are left out, so
/// the arm stands at each point for a moment.
pub(super) fn of(text: &str) -> Vec<PathStep> {
    text.lines()
        .map(str::trim)
        .skip_while(|line| !line.starts_with("def exec_move_path"))
        .skip(1)
        .take_while(|line| *line != "end")
        .filter_map(step)
        .take(MOST)
        .collect()
}

pub(super) fn step(line: &str) -> Option<PathStep> {
    let straight = line.starts_with("movel(");
    if !straight && !line.starts_with("movej(") {
        return None;
    }
    let (open, close) = (line.find('[')?, line.find(']')?);
    let numbers: Vec<f64> =
        line.get(open + 1..close)?.split(',').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
    let target: [f64; 6] = numbers.try_into().ok()?;
    let named = |name: &str, usual: f64| {
        let rest = line.get(close..)?;
        let value = rest.split(',').find_map(|part| part.trim().strip_prefix(name))?;
        value.trim_end_matches([')', ' ']).trim().parse().ok().or(Some(usual))
    };
    Some(PathStep {
        straight,
        place: line.get(..open)?.ends_with('p'),
        target,
        speed: named("v=", 1.05).unwrap_or(if straight { 0.25 } else { 1.05 }),
        acceleration: named("a=", 1.4).unwrap_or(if straight { 1.2 } else { 1.4 }),
    })
}

impl PathStep {
    /// Begins it; a place that cannot be reached stops the arm.
    pub(in crate::controller) fn begin(self, robot: &mut Robot) {
        let (speed, acceleration) = (self.speed, self.acceleration);
        let here = *robot.target().0;
        let goal = pose::read(&self.target);
        let joints = match self.place {
            true => robot.arm.inverse(&goal, &here),
            false => Joints::from_slice(&self.target).ok(),
        };
        let Some(to) = joints else {
            robot.protective_stop("a path's point that no joints reach".to_owned());
            return;
        };
        let place = if self.place { goal } else { robot.arm.tool(&to) };
        robot.wish(match self.straight {
            true => Wish::Line { to: place, speed, acceleration },
            false => Wish::Joints { to, speed, acceleration },
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_read_out_of_the_script_and_nothing_else_is() {
        let text = "def rtde_control():\n def exec_move_path():\n  textmsg(\"x\")\n  movej([0,-1,1,-1,-1,0.5],a=1.2,v=0.5,r=0.02)\n  movel(p[0.1,0.2,0.3,0,3.1,0], a=0.4, v=0.1)\n  movej([1,2],a=1)\n end\n movej([0,0,0,0,0,0])\nend\n";
        let path = of(text);
        assert_eq!(path.len(), 2, "{path:?}");
        assert!(!path[0].straight && !path[0].place && (path[0].speed - 0.5).abs() < 1e-12);
        assert!(path[1].straight && path[1].place && (path[1].acceleration - 0.4).abs() < 1e-12);
    }
}
