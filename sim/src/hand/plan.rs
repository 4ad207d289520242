//! What the hand means to do on the skin, stroke by stroke.

use super::HandConfig;
use crate::random::Stream;

/// One thing that it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stroke {
    /// Goes to a place of the course; back, when it lies behind.
    Go { to_m: f64, speed_m_s: f64 },
    /// Rests on the skin.
    Pause { seconds: f64 },
    /// Lifts the probe off the skin and puts it back.
    Lift { seconds: f64 },
}

/// All that it does, in order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    pub(super) strokes: Vec<Stroke>,
}

/// What goes wrong after a stroke.
#[derive(Clone, Copy)]
enum Mishap {
    Hurry,
    Rest,
    TurnBack,
    LiftOff,
}

/// Every plan has each of them, in an order of its own, as long as it has strokes enough.
const MISHAPS: [Mishap; 4] = [Mishap::TurnBack, Mishap::Rest, Mishap::LiftOff, Mishap::Hurry];

impl Plan {
    /// The plan of one seed for a course of `length_m`: settles, goes along it in strokes of about 30 mm, settles.
    pub(super) fn new(config: &HandConfig, length_m: f64, seed: u64) -> Self {
        let mut stream = Stream::new(seed, "hand's plan");
        let count = (length_m / 0.030).ceil().max(1.0) as usize;
        let first = stream.uniform(0.0, 4.0) as usize;
        let mut strokes = vec![Stroke::Pause { seconds: 1.2 }];
        for i in 0..count {
            let wobble = if i + 1 < count { stream.uniform(-0.2, 0.2) } else { 0.0 };
            let to_m = length_m * (i as f64 + 1.0 + wobble) / count as f64;
            let speed = config.speed_mm_s * 1e-3 * stream.uniform(0.7, 1.3);
            // None on the last stroke: the way ends at its end.
            let mishap = (config.mishaps && i % 3 != 0 && i + 1 < count)
                .then(|| MISHAPS[(first + i - i / 3) % MISHAPS.len()]);
            strokes.extend(stroke(to_m, speed, mishap, &mut stream).into_iter().flatten());
        }
        strokes.push(Stroke::Pause { seconds: 0.4 });
        Self { strokes }
    }
}

fn stroke(to_m: f64, speed_m_s: f64, mishap: Option<Mishap>, stream: &mut Stream) -> [Option<Stroke>; 2] {
    let go = Some(Stroke::Go { to_m, speed_m_s });
    match mishap {
        None => [go, None],
        Some(Mishap::Hurry) => [Some(Stroke::Go { to_m, speed_m_s: 2.2 * speed_m_s }), None],
        Some(Mishap::Rest) => [go, Some(Stroke::Pause { seconds: stream.uniform(0.5, 1.5) })],
        Some(Mishap::TurnBack) => {
            let back = (to_m - stream.uniform(0.014, 0.024)).max(0.0);
            [go, Some(Stroke::Go { to_m: back, speed_m_s })]
        }
        Some(Mishap::LiftOff) => [go, Some(Stroke::Lift { seconds: stream.uniform(1.2, 1.8) })],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_of_a_whole_leg_has_every_mishap_and_ends_at_the_end() {
        for seed in 0..200 {
            let plan = Plan::new(&HandConfig::default(), 0.24, seed).strokes;
            let places: Vec<f64> = plan
                .iter()
                .filter_map(|s| if let Stroke::Go { to_m, .. } = s { Some(*to_m) } else { None })
                .collect();
            assert!(plan.iter().any(|s| matches!(s, Stroke::Lift { .. })));
            assert!(places.windows(2).any(|w| w[1] < w[0] - 0.005), "it never turns back");
            assert!(plan.iter().any(|s| matches!(s, Stroke::Go { speed_m_s, .. } if *speed_m_s > 0.022)));
            let last = places.iter().copied().fold(0.0, f64::max);
            assert!((last - 0.24).abs() < 1e-9, "{last}");
        }
    }
}
