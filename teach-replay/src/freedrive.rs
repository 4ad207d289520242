//! [`Freedrive`]: the arm gives way to the hand by its own means.

use probepath_robot::{Command, Controller, State};

/// How long nobody may hold the button before it ends (s).
const WAIT_S: f64 = 60.0;

/// Where freedrive is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Waiting { ticks: u32 },
    Free,
    Done,
}

/// Gives way to the hand by the arm's own means while the operator holds the button: the other way of hand guiding,
/// beside [`HandGuide`](crate::HandGuide), for arms whose controller can do it.
///
/// ```text
///            button held              button let go
///  Waiting ──────────────▶ Free ─────────────────────▶ Done: the end, where the hand left it
///     │ nobody holds it for too long                     ▲
///     └──────────────────────────────────────────────────┘
/// ```
///
/// How it gives way, how fast it may be led and how hard it may be pushed is the arm's; the guard goes on watching.
#[derive(Clone, Debug)]
pub struct Freedrive {
    stage: Stage,
    wait_ticks: u32,
}

impl Freedrive {
    /// Freedrive that waits for the button; `period_s` is the time between two ticks.
    pub fn new(period_s: f64) -> Self {
        // A period that is none waits for one tick.
        let wait_ticks = (WAIT_S / period_s).clamp(1.0, f64::from(u32::MAX));
        Self { stage: Stage::Waiting { ticks: 0 }, wait_ticks: wait_ticks as u32 }
    }

    /// Whether the hand leads now.
    pub fn is_guiding(&self) -> bool {
        self.stage == Stage::Free
    }
}

impl Controller for Freedrive {
    fn step(&mut self, state: &State) -> Option<Command> {
        self.stage = match self.stage {
            Stage::Waiting { .. } if state.guiding => Stage::Free,
            Stage::Waiting { ticks } if ticks >= self.wait_ticks => Stage::Done,
            Stage::Waiting { ticks } => Stage::Waiting { ticks: ticks + 1 },
            Stage::Free if !state.guiding => Stage::Done,
            other => other,
        };
        match self.stage {
            Stage::Waiting { .. } => Some(Command::Position(state.commanded)),
            Stage::Free => Some(Command::Freedrive),
            Stage::Done => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use probepath_frames::{Stamp, Wrench};
    use probepath_robot::Joints;

    use super::*;

    fn state(guiding: bool) -> State {
        let at = Joints::splat(6, 0.3);
        let (position, velocity, commanded) = (at, Joints::zeros(6), at);
        let stamp = Stamp::ZERO;
        State {
            tick: 0,
            stamp,
            position,
            velocity,
            commanded,
            wrench: Wrench::zero(),
            guiding,
            safety: Default::default(),
            age: probepath_frames::Span::ZERO,
        }
    }

    #[test]
    fn the_arm_holds_until_the_button_is_held_and_ends_when_it_is_let_go() {
        let mut freedrive = Freedrive::new(0.002);
        let held = Command::Position(state(false).commanded);
        assert!((0..100).all(|_| freedrive.step(&state(false)) == Some(held)));
        assert!((0..100).all(|_| freedrive.step(&state(true)) == Some(Command::Freedrive)));
        assert!(freedrive.is_guiding());
        assert_eq!(freedrive.step(&state(false)), None);
        // A button held once more is another guiding.
        assert_eq!(freedrive.step(&state(true)), None);
    }

    #[test]
    fn nobody_at_the_button_for_a_minute_ends_it() {
        let mut freedrive = Freedrive::new(0.002);
        let ticks = (0..40_000).take_while(|_| freedrive.step(&state(false)).is_some()).count();
        assert_eq!(ticks, 30_000);
    }
}
