//! What the software may not know.

use std::sync::Arc;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Pose, Probe, Span, Stamp, World};
use probepath_us_capture::Setting;

use super::config::CellConfig;
use super::nominal::Nominal;
use super::scene::{Moment, Shared};
use crate::random::Stream;
use crate::subject::Subject;

/// What was truly there. For tests and for `validate`; the code under test never sees it.
#[derive(Clone, Debug)]
pub struct Truth {
    subject: Arc<Subject>,
    scene: Shared,
    nominal: Nominal,
    probe_from_image_error: Pose<Probe, Probe>,
    image_latency: Span,
}

impl Truth {
    pub(super) fn new(
        config: &CellConfig,
        nominal: &Nominal,
        subject: &Arc<Subject>,
        scene: &Shared,
        seed: u64,
    ) -> Self {
        let mut stream = Stream::new(seed, "calibration error");
        let mut toward = |length: f64| stream.normal3().normalize() * length;
        let off = toward(config.machine.calibration_error_mm * 1e-3);
        let turn = toward(config.machine.calibration_error_deg.to_radians());
        let (probe, image) = (UnitQuaternion::from_scaled_axis(turn), Vector3::from(off));
        let latency_ms = (config.machine.latency_ms + config.knobs.machine.unknown_latency_ms).max(0.0);
        Self {
            subject: subject.clone(),
            scene: scene.clone(),
            nominal: nominal.clone(),
            // FRAMES: the small motion from the calibrated plane to the true one, written in Probe.
            probe_from_image_error: Pose::assume(Isometry3::from_parts(image.into(), probe)),
            image_latency: Span::from_seconds(latency_ms * 1e-3),
        }
    }

    /// What lies on the table: its surface and its vessels, exactly.
    pub fn subject(&self) -> &Subject {
        &self.subject
    }

    /// Where the B-scan's plane truly is on the probe.
    pub fn probe_from_image(&self, setting: &Setting) -> Pose<Probe, Image> {
        self.probe_from_image_error * self.nominal.probe_from_image(setting)
    }

    /// How long a B-scan truly takes to arrive.
    pub const fn image_latency(&self) -> Span {
        self.image_latency
    }

    /// Everything that was, tick by tick, from the world's beginning.
    pub fn moments(&self) -> Vec<Moment> {
        self.scene.lock().moments().to_vec()
    }

    /// What is now.
    pub fn now(&self) -> Moment {
        *self.scene.lock().last()
    }

    /// Where the probe truly was at an instant between beginning and now.
    pub fn world_from_probe(&self, at: Stamp) -> Option<Pose<World, Probe>> {
        self.scene.lock().world_from_probe(at)
    }
}
