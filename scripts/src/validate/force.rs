//! The contact force along the leg: 5 N at 10 and 20 mm/s on skin of 0.3 to 3 N/mm, alone and under each disturbance.
//!
//! The force is judged as the skin felt it. The measured one, noise of the sensor included, stands beside it.

mod stand;

use std::path::Path;
use std::sync::Arc;

use probepath_robot::Operator;
use probepath_sim::{DisturbanceConfig, SkinConfig};

use super::bench::{Folder, taught, tell};
use super::{Goal, Goals, ValidateError};
use crate::progress::Progress;
use crate::session::{CellFile, ScanWish, SessionError, TrueContact};
use stand::Stand;

/// The paths' speeds (m/s).
const SPEEDS: [f64; 2] = [0.010, 0.020];
/// What the force has to keep (N).
const HELD_N: f64 = 0.10;
const OVERSHOOT_N: f64 = 0.5;
const STEADY_N: f64 = 0.02;
const DISTURBED_N: f64 = 0.5;
const SOFT_N: f64 = 10.0;
/// The best that was published (FIELD.md section 9).
const PUBLISHED: &str = "0.098";

/// What a scan of one seed came to.
struct Held {
    wanted_m_s: f64,
    truth: TrueContact,
    measured_rms_n: f64,
}

/// Scans the leg of each seed without looking, and holds the force that the skin felt against the one that was set.
///
/// # Errors
/// When a session fails.
pub fn force(seeds: u64, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    if seeds == 0 {
        return Err(ValidateError::NoSeeds);
    }
    let folder = Folder::new("force")?;
    let bench = Bench { seeds, folder: folder.path(), progress };
    let mut rows = bench.undisturbed()?;
    for (name, disturbance) in disturbances() {
        for (skin, config) in skins() {
            let disturbed = Skin { disturbance: disturbance.clone(), config };
            rows.extend(bench.disturbed(&format!("{name}, skin of {skin}"), &disturbed)?);
        }
    }
    Ok(Goals::new("force: 5 N along the leg at 10 and 20 mm/s, skin of 0.3 to 3 N/mm", seeds, rows))
}

/// Breathing, a leg that moves, a bump, a sensor that drifts, and skin that is suddenly stiffer and dry.
fn disturbances() -> [(&'static str, DisturbanceConfig); 5] {
    [
        ("breathing ±5 mm, 0.25 Hz", DisturbanceConfig::breathing()),
        ("leg moves 10 mm in 0.5 s", DisturbanceConfig::moving_leg()),
        ("bump of 5 mm over 10 mm", DisturbanceConfig::bump()),
        ("sensor drifts 0.5 N/min", DisturbanceConfig::drifting_sensor()),
        ("skin 1.5 times stiffer at a step, dry", DisturbanceConfig::hard_and_dry()),
    ]
}

/// The leg's own skin, and the softest and the hardest of it everywhere: a disturbance falls where it falls, and on these
/// it falls on the worst place.
fn skins() -> [(&'static str, SkinConfig); 3] {
    let even = |n_mm| SkinConfig { softest_n_mm: n_mm, hardest_n_mm: n_mm, ..SkinConfig::default() };
    let SkinConfig { softest_n_mm, hardest_n_mm, .. } = SkinConfig::default();
    [
        ("0.3 to 3 N/mm", SkinConfig::default()),
        ("0.3 N/mm", even(softest_n_mm)),
        ("3 N/mm", even(hardest_n_mm)),
    ]
}

/// What is under the probe.
#[derive(Clone, Debug, Default)]
struct Skin {
    config: SkinConfig,
    disturbance: DisturbanceConfig,
}

/// Where and how often.
struct Bench<'a> {
    seeds: u64,
    folder: &'a Path,
    progress: &'a dyn Progress,
}

impl Bench<'_> {
    /// The leg at rest: along it at either speed, touching down, standing still.
    fn undisturbed(&self) -> Result<Vec<Goal>, ValidateError> {
        let (mut rows, mut overshoot, mut steady) = (Vec::new(), Vec::new(), Vec::new());
        for speed_m_s in SPEEDS {
            let mm_s = speed_m_s * 1e3;
            let held = self.all("at rest", speed_m_s, &Skin::default())?;
            let of = |pick: fn(&Held) -> f64| held.iter().map(pick).collect::<Vec<_>>();
            rows.push(Goal::of(
                format!("true force at {mm_s:.0} mm/s, RMS error, N"),
                &of(|held| held.truth.rms_n),
                Some(HELD_N),
                Some(PUBLISHED),
            ));
            rows.push(Goal::of(
                format!("measured force at {mm_s:.0} mm/s, RMS error with the sensor's noise, N"),
                &of(|held| held.measured_rms_n),
                None,
                None,
            ));
            rows.push(Goal::of(
                format!("largest true force at {mm_s:.0} mm/s, N"),
                &of(|held| held.truth.most_n),
                None,
                None,
            ));
            rows.push(Goal::of(
                format!("time along the path at {mm_s:.0} mm/s, as a multiple of what that speed takes"),
                &of(|held| held.wanted_m_s / held.truth.speed_m_s),
                None,
                None,
            ));
            rows.extend(self.undisturbed_on_even_skins(speed_m_s)?);
            overshoot.extend(of(|held| held.truth.overshoot_n));
            steady.extend(held.iter().filter_map(|held| held.truth.steady_n));
        }
        rows.push(Goal::of("true force, touch-down overshoot, N", &overshoot, Some(OVERSHOOT_N), None));
        rows.push(Goal::of("true force, mean error standing still, N", &steady, Some(STEADY_N), None));
        Ok(rows)
    }

    /// The same on the softest skin everywhere, and on the hardest.
    fn undisturbed_on_even_skins(&self, speed_m_s: f64) -> Result<Vec<Goal>, ValidateError> {
        let row = |(name, config): (&str, SkinConfig)| {
            let skin = Skin { config, ..Skin::default() };
            let held = self.all(&format!("at rest, skin of {name}"), speed_m_s, &skin)?;
            let rms: Vec<_> = held.iter().map(|held| held.truth.rms_n).collect();
            let what = format!("true force at {:.0} mm/s, skin of {name}, RMS error, N", speed_m_s * 1e3);
            Ok(Goal::of(what, &rms, Some(HELD_N), None))
        };
        skins().into_iter().skip(1).map(row).collect()
    }

    /// The leg under one disturbance, which begins when the path has been taught.
    fn disturbed(&self, name: &str, skin: &Skin) -> Result<Vec<Goal>, ValidateError> {
        let mut rows = Vec::new();
        for speed_m_s in SPEEDS {
            let mm_s = speed_m_s * 1e3;
            let held = self.all(name, speed_m_s, skin)?;
            let rms: Vec<_> = held.iter().map(|held| held.truth.rms_n).collect();
            let most: Vec<_> = held.iter().map(|held| held.truth.most_n).collect();
            rows.push(Goal::of(
                format!("{name}, {mm_s:.0} mm/s: true RMS error, N"),
                &rms,
                Some(DISTURBED_N),
                None,
            ));
            rows.push(Goal::of(
                format!("{name}, {mm_s:.0} mm/s: largest true force, N"),
                &most,
                Some(SOFT_N),
                None,
            ));
        }
        Ok(rows)
    }

    fn all(&self, name: &str, speed_m_s: f64, skin: &Skin) -> Result<Vec<Held>, ValidateError> {
        let what = format!("force, {name}, {:.0} mm/s", speed_m_s * 1e3);
        let one = |seed| {
            tell(self.progress, &what, seed - 1, self.seeds);
            self.one(seed, speed_m_s, skin)
        };
        (1..=self.seeds).map(one).collect()
    }

    /// One seed: taught at rest, then disturbed and scanned; half way, undisturbed, the probe stands still for a while.
    fn one(&self, seed: u64, speed_m_s: f64, skin: &Skin) -> Result<Held, ValidateError> {
        let wrong = |source: SessionError| ValidateError::Session { seed, source };
        let operator = Operator::new();
        let at_rest = skin.disturbance == DisturbanceConfig::default();
        let stand: Arc<dyn Progress> =
            if at_rest { Arc::new(Stand::new(operator.clone())) } else { Arc::new(()) };
        let mut cell = CellFile::default();
        cell.simulated.skin = skin.config.clone();
        let (mut session, path) = taught(&cell, seed, self.folder, (operator, stand))?;
        session.disturb(&skin.disturbance).map_err(wrong)?;
        let wish = ScanWish { look: false, speed_m_s, ..ScanWish::default() };
        let scan = session.scan(&path, &wish).map_err(wrong)?;
        let truth = session.true_contact(&scan).ok_or(wrong(SessionError::Order("nothing was followed")))?;
        Ok(Held { wanted_m_s: speed_m_s, truth, measured_rms_n: scan.figures.force_n.rms_error })
    }
}
