//! What the skin truly felt in a scan; only a simulated cell can say.

use nalgebra::Vector3;
use probepath_frames::Stamp;
use probepath_sim::{DisturbanceConfig, Moment, TICK};

use super::{Scan, Session, SessionError};

/// No contact for so long (s) means that what comes next is a touch-down.
const APART_S: f64 = 0.5;
/// Standing still: the probe goes no further than this across its axis (m) within the time (s).
const STILL_M: f64 = 20e-6;
const STILL_S: f64 = 0.1;
/// The path begins when the force is nearly there: the touch-down lasts this much longer (s).
const TOUCHED_S: f64 = 1.0;
/// The force gets this long to settle (s), and is then looked at for at least as long.
const SETTLE_S: f64 = 1.0;

/// The contact force as it truly was (N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueContact {
    /// Root mean square of its error while the probe went along the path; standing still is left out.
    pub rms_n: f64,
    /// How far it was above the set force from the touch until a second along the path.
    pub overshoot_n: f64,
    /// The largest, from touch-down to lift.
    pub most_n: f64,
    /// The mean error while the probe stood still on the skin, settled; none when it never did.
    pub steady_n: Option<f64>,
    /// How fast the probe went along the path, on the mean (m/s); standing still is left out.
    pub speed_m_s: f64,
}

impl Session {
    /// From now on the contact is disturbed like this, in a cell that is simulated in this process.
    ///
    /// # Errors
    /// When a number is impossible, or the cell is another.
    pub fn disturb(&self, disturbance: &DisturbanceConfig) -> Result<(), SessionError> {
        const ELSEWHERE: SessionError =
            SessionError::Order("only a cell that is simulated in this process can be disturbed");
        let simulated = self.cell.simulated.as_ref().ok_or(ELSEWHERE)?;
        Ok(simulated.disturb(disturbance)?)
    }

    /// What the skin truly felt in a scan; only a simulated cell can say. None when the path was never followed.
    pub fn true_contact(&self, scan: &Scan) -> Option<TrueContact> {
        let (from, until) = scan.followed?;
        let moments = self.cell.simulated.as_ref()?.truth().moments();
        let set = scan.wish.force_n;
        let at = |stamp: Stamp| moments.partition_point(|moment| moment.stamp < stamp);
        let (begin, end) = (at(from), at(until));
        let followed = moments.get(begin..=end.min(moments.len().checked_sub(1)?))?;
        let touched = touch_down(&moments, begin);
        let most = |of: &[Moment]| of.iter().map(pressing).fold(0.0, f64::max);
        let moving = (0..followed.len()).filter(|i| !is_still(followed, *i)).filter_map(|i| followed.get(i));
        let squares: Vec<f64> = moving.map(|moment| (pressing(moment) - set).powi(2)).collect();
        Some(TrueContact {
            rms_n: (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
            overshoot_n: (most(moments.get(touched..(begin + ticks(TOUCHED_S)).min(moments.len()))?) - set)
                .max(0.0),
            most_n: most(moments.get(touched..)?),
            steady_n: steady(followed).map(|force| (force - set).abs()),
            speed_m_s: mean_speed(followed),
        })
    }
}

fn pressing(moment: &Moment) -> f64 {
    -moment.skin.force.z
}

fn ticks(seconds: f64) -> usize {
    (seconds / TICK.seconds()).round() as usize
}

/// The first moment of the contact that goes on at `begin`.
fn touch_down(moments: &[Moment], begin: usize) -> usize {
    let mut apart = 0;
    for (i, moment) in moments.iter().enumerate().take(begin).rev() {
        apart = if pressing(moment) > 0.0 { 0 } else { apart + 1 };
        if apart > ticks(APART_S) {
            return i;
        }
    }
    0
}

/// Whether the probe has gone nowhere for a while at moment `i`.
fn is_still(followed: &[Moment], i: usize) -> bool {
    let before = i.checked_sub(ticks(STILL_S)).and_then(|before| followed.get(before));
    before.zip(followed.get(i)).is_some_and(|(before, now)| across(before, now) < STILL_M)
}

/// How fast the probe went across its axis, on the mean (m/s), where it did not stand still.
fn mean_speed(followed: &[Moment]) -> f64 {
    let way = |i: usize| Some(across(followed.get(i.checked_sub(1)?)?, followed.get(i)?));
    let moving = || (0..followed.len()).filter(|i| !is_still(followed, *i));
    moving().filter_map(way).sum::<f64>() / (moving().count() as f64 * TICK.seconds())
}

/// The mean force over the longest time that the probe stood still, once it had settled.
fn steady(followed: &[Moment]) -> Option<f64> {
    let settle = ticks(SETTLE_S);
    let (mut run, mut best) = (0, 0..0);
    for i in 0..followed.len() {
        run = if is_still(followed, i) { run + 1 } else { 0 };
        if run > best.len() {
            best = i + 1 - run..i + 1;
        }
    }
    let settled = followed.get(best.start + settle..best.end)?;
    let mean = settled.iter().map(pressing).sum::<f64>() / settled.len() as f64;
    (settled.len() >= settle).then_some(mean)
}

/// How far the probe went across its axis (m).
fn across(before: &Moment, now: &Moment) -> f64 {
    let axis = before.world_from_probe.z_axis().vector();
    let way: Vector3<f64> =
        now.world_from_probe.origin().vector() - before.world_from_probe.origin().vector();
    (way - axis * way.dot(&axis)).norm()
}
