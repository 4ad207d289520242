//! Visiting a phantom: the plan of poses and sweeps, and the B-scans of it with the probe's track.

use probepath_frames::{Direction, Phantom, Point, Pose, Probe, Span, Track, World};
use probepath_robot::{GuardLimits, Plane, Workspace};
use probepath_teach_replay::{PlanSettings, Round, RoundPhase, RoundStatus, Stop};
use probepath_us_capture::plan::{Bench, Expected, VisitOptions, VisitPlan, expected};
use probepath_us_capture::shots::{Shot, Shots};
use probepath_us_capture::spatial::Spatial;
use probepath_us_capture::{Capture, Counts, Keeping, PlacedBScan, Setting};

use super::locate::Located;
use super::motion::Motion;
use super::recorder::{Eye, Recorder, Stand};
use super::{Session, SessionError, motion};

const STEP: &str = "visiting the phantom";
/// The fastest that the probe goes in water (m/s): 50 mm/s.
const MOST_SPEED_M_S: f64 = 0.050;
/// How much faster the guard lets it go than it was told to: corners are cut a little.
const GUARD_MARGIN: f64 = 1.2;
/// In water nothing presses: forces above these are a collision (N). The sensor drifts and rings less.
const FORCE_SOFT_N: f64 = 3.0;
const FORCE_HARD_N: f64 = 6.0;
/// Poses further apart than this have a gap between them: a loop that missed ten ticks.
const WIDEST_GAP: Span = Span::from_milliseconds(20);
/// B-scans come this much later than the machine says, at the latest.
const LATE: Span = Span::from_milliseconds(100);

/// A dot that is off by no more than this is exact (m).
const EXACT_M: f64 = 1e-6;

/// How a phantom is to be visited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisitWish {
    /// The fastest from stop to stop (m/s).
    pub speed_m_s: f64,
    /// How long the probe rests at each stop before B-scans count (s).
    pub settle_s: f64,
    /// How long B-scans count at each stop (s).
    pub look_s: f64,
}

impl Default for VisitWish {
    fn default() -> Self {
        Self { speed_m_s: MOST_SPEED_M_S, settle_s: 0.3, look_s: 0.12 }
    }
}

/// A round of stops around a phantom: at rest, and to and fro.
#[derive(Clone, Debug)]
pub struct Visits {
    located: Located,
    at_rest: Vec<Pose<World, Probe>>,
    sweeps: Vec<probepath_us_capture::plan::Sweep>,
    options: VisitOptions,
}

/// What is planned for a calibration.
#[derive(Clone, Debug)]
pub struct CalibrationPlan {
    /// To calibrate from.
    pub stops: Visits,
    /// To check from.
    pub others: Visits,
    /// All of it, with what it promises.
    pub plan: VisitPlan,
}

/// B-scans of a phantom.
#[derive(Clone, Debug)]
pub struct PhantomImages {
    /// The phantom, where it stood.
    pub located: Located,
    /// The B-scans and the probe's track.
    pub shots: Shots,
    /// How the machine was set.
    pub setting: Setting,
    /// Where the probe rested, and how that was planned.
    pub visits: Visits,
    /// What became of all that came.
    pub counts: Counts,
}

/// B-scans, where the probe was at every tick, and what became of what came.
type Seen = (Vec<PlacedBScan>, Track<World, Probe>, Counts);

impl VisitWish {
    fn check(&self) -> Result<(), SessionError> {
        let limits = [
            ("speed", self.speed_m_s * 1e3, 1.0, MOST_SPEED_M_S * 1e3, "mm/s"),
            ("settle", self.settle_s, 0.0, 10.0, "s"),
            ("look", self.look_s, 0.01, 60.0, "s"),
        ];
        for (what, value, least, most, unit) in limits {
            // Written so that NaN is refused as well.
            if !(value >= least && value <= most) {
                let wanted = format!("it has to be between {least} and {most} {unit}");
                return Err(SessionError::Wish { what, value: format!("{value} {unit}"), wanted });
            }
        }
        Ok(())
    }
}

impl Session {
    /// Plans from where to look at a phantom, with what the calibration may be expected to be good to. Nothing moves.
    ///
    /// # Errors
    /// When the arm does not answer, or too few poses can be used.
    pub fn plan_calibration(
        &mut self,
        located: &Located,
        options: &VisitOptions,
    ) -> Result<CalibrationPlan, SessionError> {
        self.begin_exam("CALIBRATION")?;
        let start = self.ask_where("planning the calibration", "plan")?.commanded;
        let settings = self.in_water(located, options.clearance_m);
        let (arm, base_from_world) = (self.cell.probe_arm(), self.cell.facts.world_from_base.inverse());
        let options = VisitOptions { place_sd_m: located.sd_m, place_sd_rad: located.sd_rad, ..*options };
        let (phantom, world_from_phantom) = (&located.phantom, located.world_from_phantom);
        let calibration = self.cell.calibrated()?;
        let (setting, spacing) = (calibration.setting, calibration.setting.spacing);
        let pixels = |length_m: f64, pixel_m: f64| (length_m / pixel_m).round() as usize;
        let bench = Bench {
            phantom,
            world_from_phantom,
            probe_from_image: calibration.probe_from_image,
            upright: self.cell.facts.world_from_base * arm.probe(&start),
            setting,
            size: (pixels(setting.window_width_m, spacing.x_m), pixels(setting.window_height_m, spacing.y_m)),
        };
        let reachable =
            |pose: &Pose<World, Probe>| arm.posture(&(base_from_world * *pose), &start, &settings).is_ok();
        let plan = VisitPlan::new(&bench, &options, reachable)?;
        self.say(&format!(
            "Planned {} poses, {} sweeps and {} poses to check from; expected standard error: {}.",
            plan.poses.len(),
            plan.sweeps.len(),
            plan.held_out.len(),
            plan.expected
        ));
        let visits = |at_rest: &[Pose<World, Probe>], sweeps: &[_]| Visits {
            located: located.clone(),
            at_rest: at_rest.to_vec(),
            sweeps: sweeps.to_vec(),
            options,
        };
        Ok(CalibrationPlan {
            stops: visits(&plan.poses, &plan.sweeps),
            others: visits(&plan.held_out, &[]),
            plan,
        })
    }

    /// Goes from stop to stop, slowly and without touching anything, and takes B-scans at rest and on the sweeps.
    ///
    /// # Errors
    /// When a stop cannot be reached (nothing moves then), the motion was stopped, or no B-scan came.
    pub fn visit(&mut self, visits: &Visits, wish: &VisitWish) -> Result<PhantomImages, SessionError> {
        wish.check()?;
        self.begin_exam("CALIBRATION")?;
        let start = self.ask_where(STEP, "plan")?.commanded;
        let settings = self.in_water(&visits.located, visits.options.clearance_m);
        let (arm, operator) = (self.cell.probe_arm(), self.opening.operator.clone());
        let stops = visits.stops(wish, &self.cell.facts.world_from_base.inverse());
        let round = Round::new(&stops, &arm, (&start, &start), &settings, operator)?;
        let round = if self.resuming { round.slowly() } else { round };
        self.say(&format!("Visiting {} places: {:.0} s.", stops.len(), round.duration_s()));
        let usual = *self.guard.limits();
        self.guard.set_limits(self.cell.as_the_file_says(limits_in_water(wish.speed_m_s)));
        let gone = self.go_round(round);
        self.guard.set_limits(usual);
        let (images, track, counts) = gone?;
        self.say(&format!("{} B-scans of the phantom.", images.len()));
        self.images(visits, images, track, counts)
    }

    fn images(
        &self,
        visits: &Visits,
        images: Vec<PlacedBScan>,
        track: Track<World, Probe>,
        counts: Counts,
    ) -> Result<PhantomImages, SessionError> {
        let first = images.first().ok_or(SessionError::NoImages)?;
        let (size, setting) = ((first.bscan.width(), first.bscan.height()), first.bscan.setting);
        let shot = |placed: &PlacedBScan| Shot {
            number: placed.bscan.number,
            stamp: placed.bscan.formed,
            pixels: Ok(placed.bscan.pixels().into()),
        };
        let shots = Shots::new(size, images.iter().map(shot).collect(), track)?;
        Ok(PhantomImages { located: visits.located.clone(), shots, setting, visits: visits.clone(), counts })
    }

    /// What planning may use in the water over a phantom: nothing lower than the clearance over its wires.
    fn in_water(&self, located: &Located, clearance_m: f64) -> PlanSettings {
        let base_from_world = self.cell.facts.world_from_base.inverse();
        let up = Direction::<World>::y().reversed();
        let wires = located.phantom.wires.iter().flat_map(|wire| [wire.front, wire.back]);
        let heights = wires.map(|end| height(&located.world_from_phantom, end));
        let over = Point::<World>::new(0.0, -heights.fold(f64::NEG_INFINITY, f64::max) - clearance_m, 0.0);
        let plane = Plane { through: base_from_world * over, inward: base_from_world * up };
        let workspace: Workspace = self.cell.workspace().and(plane);
        PlanSettings { air_speed: MOST_SPEED_M_S, workspace, ..PlanSettings::default() }
    }

    fn go_round(&mut self, mut round: Round) -> Result<Seen, SessionError> {
        let mut capture = Capture::new(self.cell.calibrated()?.clone(), Keeping::All)?;
        let (mut images, mut track) = (Vec::new(), Track::new(WIDEST_GAP));
        let latency = self.cell.image_latency;
        let watch = round.watch();
        let stand = || stand_of(&watch.status());
        let exam = self.exam.as_ref().ok_or(SessionError::Order("the exam was not begun"))?;
        let (facts, operator) = (&self.cell.facts, self.opening.operator.clone());
        let arm = &mut *self.cell.arm;
        let moving = Motion { step: STEP, arm, exam, facts, stand: &stand, punctual: self.punctual.as_mut() };
        let eye = Eye {
            machine: &mut **self.cell.machine.as_mut().ok_or(SessionError::NoMachine)?,
            capture: &mut capture,
            images: &mut images,
            operator: &operator,
            paused: false,
            looked: None,
            latest: Span::from_nanoseconds(latency.nanoseconds() + LATE.nanoseconds()),
            live: None,
        };
        let mut recorder = Recorder {
            exam,
            facts,
            progress: &*self.opening.progress,
            step: STEP,
            recording: None,
            track: Some(&mut track),
            eye: Some(eye),
            figures: None,
            zero: None,
            now: self.now,
        };
        let done = motion::perform(moving, &mut round, &mut self.guard, &mut recorder);
        self.now = recorder.now;
        self.resuming &= done.is_err();
        done?;
        if watch.status().phase == RoundPhase::StartMoved {
            let why = "the arm moved between planning and starting: plan again".to_owned();
            return Err(SessionError::Ended { step: STEP, why });
        }
        capture.finish();
        self.keep_rest(&mut capture, &mut images);
        Ok((images, track, capture.counts()))
    }
}

impl Visits {
    /// What the arm's own error does to a calibration from these places, were every dot exact: standard error of a
    /// reconstructed point over the image. The scatter of the dots does not tell it: images at one place share it.
    pub(super) fn error_of_the_arm(
        &self,
        spatial: &Spatial,
        setting: Setting,
        size: (usize, usize),
    ) -> Option<Expected> {
        let exact = VisitOptions { dot_sd_m: [EXACT_M; 2], ..self.options };
        let bench = Bench {
            phantom: spatial.phantom(),
            world_from_phantom: spatial.fit.world_from_phantom,
            probe_from_image: spatial.fit.probe_from_image,
            upright: *self.at_rest.first()?,
            setting,
            size,
        };
        Some(expected(&bench, &exact, &self.at_rest))
    }

    /// The stops in the arm's base: every pose at rest, then every sweep from end to end and back.
    fn stops(&self, wish: &VisitWish, base_from_world: &Pose<probepath_frames::Base, World>) -> Vec<Stop> {
        let still = |pose: &Pose<World, Probe>| Stop {
            base_from_probe: *base_from_world * *pose,
            speed_m_s: wish.speed_m_s,
            look_on_the_way: false,
            settle_s: wish.settle_s,
            look_s: wish.look_s,
        };
        let mut stops: Vec<Stop> = self.at_rest.iter().map(still).collect();
        for sweep in &self.sweeps {
            stops.push(Stop { look_s: 0.0, ..still(&sweep.from) });
            for pass in 0..sweep.passes {
                let end = if pass % 2 == 0 { &sweep.to } else { &sweep.from };
                let speed_m_s = sweep.speed_m_s;
                stops.push(Stop {
                    speed_m_s,
                    look_on_the_way: true,
                    settle_s: 0.0,
                    look_s: 0.0,
                    ..still(end)
                });
            }
        }
        // The last images are still on their way when the last stop is done.
        if let Some(last) = stops.last().copied() {
            let settle_s = 0.3;
            stops.push(Stop { look_on_the_way: false, settle_s, look_s: 0.0, ..last });
        }
        stops
    }
}

/// Height of a point over the World's origin (m).
fn height(world_from_phantom: &Pose<World, Phantom>, point: Point<Phantom>) -> f64 {
    -(*world_from_phantom * point).vector().y
}

/// What the guard watches for in water.
fn limits_in_water(speed_m_s: f64) -> GuardLimits {
    GuardLimits {
        force_soft_n: FORCE_SOFT_N,
        force_hard_n: FORCE_HARD_N,
        free_speed_m_s: speed_m_s * GUARD_MARGIN,
        skin_speed_m_s: speed_m_s * GUARD_MARGIN,
        ..GuardLimits::default()
    }
}

fn stand_of(status: &RoundStatus) -> Stand {
    let (phase, look) = match status.phase {
        RoundPhase::Going => ("go", false),
        RoundPhase::Sweeping => ("sweep", true),
        RoundPhase::Looking => ("look", true),
        RoundPhase::Done | RoundPhase::StartMoved => ("done", false),
    };
    Stand { phase, along_m: None, look, fraction: status.stop as f64 / status.of.max(1) as f64 }
}

#[cfg(test)]
mod tests;
