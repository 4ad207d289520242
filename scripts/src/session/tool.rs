//! What the arm carries, found by turning the probe in the air; and the force sensor's zero, watched from then on.

use std::fmt;

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Base, Flange, Point, Pose, Probe, Stamp, Wrench};
use probepath_robot::{Air, Tick, ToolError, ToolFit, ToolReading, Wish, identify};
use probepath_teach_replay::{PlanSettings, Round, RoundPhase, Stop};
use serde::Serialize;

use super::motion::{Motion, Watcher};
use super::recorder::{Facts, Stand};
use super::{Session, SessionError, motion};

const STEP: &str = "identifying the tool";
/// The probe is turned about its own face by so much about its x and y axes (degrees): to either side, and across.
const TILTS_DEG: [(f64, f64); 9] = [
    (25.0, 0.0),
    (18.0, 18.0),
    (0.0, 25.0),
    (-18.0, 18.0),
    (-25.0, 0.0),
    (-18.0, -18.0),
    (0.0, -25.0),
    (18.0, -18.0),
    (0.0, 0.0),
];
/// With fewer that can be reached nothing moves.
const LEAST_POSES: usize = 6;
/// How fast (m/s), how long it rests before the sensor is read, and how long it is read (s).
const SPEED_M_S: f64 = 0.05;
const SETTLE_S: f64 = 0.6;
const LOOK_S: f64 = 0.6;
/// A weight (N) below this has no centre worth telling.
const LEAST_N: f64 = 0.2;
/// Standard gravity (m/s^2).
const GRAVITY_M_S2: f64 = 9.806_65;
/// How long the probe rests until the zero is judged, beyond what the watch needs (s).
const REST_S: f64 = 0.1;

/// What hangs on the force sensor: what the controller was told, and what the sensor still felt of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdentifiedTool {
    /// Its mass (kg), with one standard error.
    pub mass_kg: f64,
    /// See `mass_kg`.
    pub mass_error_kg: f64,
    /// Its centre of gravity from the flange, in the flange's axes (mm); none when it weighs next to nothing.
    pub centre_of_gravity_mm: Option<[f64; 3]>,
    /// Standard errors of its coordinates (mm).
    pub centre_error_mm: Option<[f64; 3]>,
    /// What the controller was told, and takes off before anybody reads the force: payload (kg), centre (mm); none where
    /// it is not told anything.
    pub told: Option<(f64, [f64; 3])>,
    /// What the sensor reads without weight (N), along the probe's axes.
    pub bias_n: [f64; 3],
    /// The same (N m).
    pub bias_n_m: [f64; 3],
    /// Root mean square of what the poses are off (N, N m).
    pub left: (f64, f64),
    /// How many poses it is from.
    pub poses: usize,
}

impl Session {
    /// Turns the probe in the air, where it hangs now, about its own face: weight, centre of gravity and the sensor's
    /// bias by least squares. From then on the sensor's drift is judged by them.
    ///
    /// # Errors
    /// When fewer than six of the poses can be reached, the motion was stopped, or something touched the probe.
    pub fn identify_tool(&mut self) -> Result<IdentifiedTool, SessionError> {
        self.begin_exam("TOOL")?;
        let start = self.ask_where(STEP, "plan")?.commanded;
        let settings = PlanSettings {
            air_speed: SPEED_M_S,
            workspace: self.cell.workspace(),
            ..PlanSettings::default()
        };
        let arm = self.cell.probe_arm();
        let here = arm.probe(&start);
        let stops: Vec<Stop> = TILTS_DEG.iter().map(|tilt| stop(&here, *tilt)).collect();
        let can = |stop: &Stop| arm.posture(&stop.base_from_probe, &start, &settings).is_ok();
        let stops: Vec<Stop> = stops.into_iter().filter(can).collect();
        if stops.len() < LEAST_POSES {
            return Err(ToolError::TooFew { given: stops.len(), wanted: LEAST_POSES }.into());
        }
        let round = Round::new(&stops, &arm, (&start, &start), &settings, self.opening.operator.clone())?;
        let round = if self.resuming { round.slowly() } else { round };
        self.say(&format!(
            "Turning the probe in the air, {} poses: {:.0} s. Nothing may touch it.",
            stops.len(),
            round.duration_s()
        ));
        let readings = self.read_in_air(round, stops.len())?;
        let down = self.cell.down();
        let fit = identify(&readings, &down)?;
        self.zero = self.cell.zero_watch(fit.tool);
        let tool = self.carried_in_all(&fit);
        self.say(&tool.to_string());
        Ok(tool)
    }

    fn read_in_air(&mut self, mut round: Round, stops: usize) -> Result<Vec<ToolReading>, SessionError> {
        let watch = round.watch();
        let stand = || {
            let status = watch.status();
            let look = status.phase == RoundPhase::Looking;
            let fraction = status.stop as f64 / status.of.max(1) as f64;
            Stand { phase: "identify", along_m: None, look, fraction }
        };
        let exam = self.exam.as_ref().ok_or(SessionError::Order("the exam was not begun"))?;
        let (facts, arm) = (&self.cell.facts, &mut *self.cell.arm);
        let moving = Motion { step: STEP, arm, exam, facts, stand: &stand, punctual: self.punctual.as_mut() };
        let mut still = Still { facts, read: vec![None; stops], now: self.now };
        let done = motion::perform(moving, &mut round, &mut self.guard, &mut still);
        self.now = still.now;
        self.resuming &= done.is_err();
        let readings = still.read.iter().flatten().map(Sum::mean).collect();
        done?;
        if watch.status().phase == RoundPhase::StartMoved {
            let why = "the arm moved between planning and starting: plan again".to_owned();
            return Err(SessionError::Ended { step: STEP, why });
        }
        Ok(readings)
    }

    /// What the controller takes off, and what was found to be left of it.
    fn carried_in_all(&self, fit: &ToolFit) -> IdentifiedTool {
        let arm = &self.cell.file.arm;
        let told = arm.payload_kg.zip(arm.centre_of_gravity_mm);
        let probe_from_flange = self.cell.facts.flange_from_probe.inverse();
        let (told_n, told_moment) = told.map_or((0.0, Vector3::zeros()), |(payload_kg, centre_mm)| {
            let [x, y, z] = centre_mm.map(|mm| mm / 1e3);
            let weight_n = payload_kg * GRAVITY_M_S2;
            (weight_n, (probe_from_flange * Point::<Flange>::new(x, y, z)).vector() * weight_n)
        });
        let weight_n = told_n + fit.tool.weight_n;
        let centre = (told_moment + fit.tool.centre_m * fit.tool.weight_n) / weight_n;
        // What the quotient's error owes to the moment's.
        let moment_error = fit.centre_error_m.zip_map(&fit.tool.centre_m, |both, centre| {
            ((both * fit.tool.weight_n).powi(2) - (centre * fit.weight_error_n).powi(2)).max(0.0).sqrt()
        });
        let centre_error = moment_error.zip_map(&centre, |moment, centre| {
            (moment.powi(2) + (centre * fit.weight_error_n).powi(2)).sqrt() / weight_n
        });
        let in_flange = self.cell.facts.flange_from_probe * Point::<Probe>::new(centre.x, centre.y, centre.z);
        let weighs = weight_n > LEAST_N;
        IdentifiedTool {
            mass_kg: weight_n / GRAVITY_M_S2,
            mass_error_kg: fit.weight_error_n / GRAVITY_M_S2,
            centre_of_gravity_mm: weighs.then(|| (in_flange.vector() * 1e3).into()),
            centre_error_mm: weighs.then(|| (centre_error * 1e3).into()),
            told,
            bias_n: fit.tool.bias.force.into(),
            bias_n_m: fit.tool.bias.torque.into(),
            left: fit.left,
            poses: fit.poses,
        }
    }

    /// Looks at the force sensor's zero while the probe rests in the air, and takes it anew there when it has drifted
    /// too far: never on the skin, nor near where something was felt.
    pub(super) fn look_at_zero(&mut self) -> Result<(), SessionError> {
        match self.rest_in_air()? {
            Air::Free { drift_n, too_far: true } => {
                self.warn(&format!(
                    "The force sensor's zero has moved by {drift_n:.2} N since it was taken; it is taken anew, the probe \
                     in the air. What was pressed may be off by as much."
                ));
                self.cell.arm.zero_sensor()?;
                if let Air::Free { .. } = self.rest_in_air()? {
                    self.zero.zero()?;
                }
            }
            Air::Touched { force_n } => self.warn(&format!(
                "The force sensor reads {force_n:.2} N where nothing should touch the probe: look at it, and zero the \
                 sensor in the air."
            )),
            Air::Free { .. } | Air::Settling => {}
        }
        Ok(())
    }

    /// Rests for as long as the zero's watch needs.
    fn rest_in_air(&mut self) -> Result<Air, SessionError> {
        let rest_s = self.zero.settings().still_s + REST_S;
        let ticks = (rest_s / self.cell.arm.period().seconds()).ceil() as usize;
        let mut air = Air::Settling;
        for _ in 0..ticks {
            let state = self.ask_where("watching the force's zero", "zero")?;
            air = self.zero.step(&state.wrench, &self.cell.facts.base_from_probe(&state.position));
        }
        Ok(air)
    }
}

/// The probe turned about its own face.
fn stop(here: &Pose<Base, Probe>, (x_deg, y_deg): (f64, f64)) -> Stop {
    let turn = Vector3::new(x_deg.to_radians(), y_deg.to_radians(), 0.0);
    // FRAMES: the probe, turned about its own origin, is the probe as it would be then.
    let turned = Pose::<Probe, Probe>::assume(Isometry3::new(Vector3::zeros(), turn));
    Stop {
        base_from_probe: *here * turned,
        speed_m_s: SPEED_M_S,
        look_on_the_way: false,
        settle_s: SETTLE_S,
        look_s: LOOK_S,
    }
}

/// Reads the sensor while the probe rests at a stop.
struct Still<'a> {
    facts: &'a Facts,
    read: Vec<Option<Sum>>,
    now: Stamp,
}

/// What was read at one stop.
#[derive(Clone, Copy)]
struct Sum {
    base_from_probe: Pose<Base, Probe>,
    wrench: Wrench<Probe>,
    count: f64,
}

impl Sum {
    fn mean(&self) -> ToolReading {
        let wrench = Wrench::new(self.wrench.force / self.count, self.wrench.torque / self.count);
        ToolReading { base_from_probe: self.base_from_probe, wrench }
    }
}

impl Watcher for Still<'_> {
    fn see(&mut self, tick: &Tick, stand: &Stand) -> Wish {
        self.now = tick.state.stamp;
        let stop = (stand.fraction * self.read.len() as f64).round() as usize;
        if let Some(place) = self.read.get_mut(stop).filter(|_| stand.look) {
            let base_from_probe = self.facts.base_from_probe(&tick.state.position);
            let before = place.map_or((Wrench::zero(), 0.0), |sum: Sum| (sum.wrench, sum.count));
            let (wrench, count) = (before.0 + tick.state.wrench, before.1 + 1.0);
            *place = Some(Sum { base_from_probe, wrench, count });
        }
        Wish::GoOn
    }
}

impl fmt::Display for IdentifiedTool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The tool weighs {:.3} kg (± {:.3})", self.mass_kg, self.mass_error_kg)?;
        if let (Some([x, y, z]), Some([dx, dy, dz])) = (self.centre_of_gravity_mm, self.centre_error_mm) {
            write!(
                f,
                ", centre of gravity {x:.1}, {y:.1}, {z:.1} mm (± {dx:.1}, {dy:.1}, {dz:.1}) from the flange"
            )?;
        }
        match self.told {
            Some((kg, [x, y, z])) => {
                write!(f, "; the controller was told {kg:.3} kg at {x:.1}, {y:.1}, {z:.1} mm")?;
            }
            None => write!(f, ", of what the sensor still feels")?,
        }
        let [x, y, z] = self.bias_n;
        write!(f, ". Bias {x:.2}, {y:.2}, {z:.2} N; {} poses fit to {:.3} N RMS.", self.poses, self.left.0)
    }
}
