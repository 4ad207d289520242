//! What the software may not know.

use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Phantom, Pose, Probe, Span, Stamp, World};
use probepath_us_capture::{PixelSpacing, Setting};

use super::config::CellConfig;
use super::nominal::Nominal;
use super::scene::{Moment, Shared};
use crate::random::Stream;
use crate::subject::Subject;
use crate::tissue::Tissue;

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

    /// The same as the echoes show it: where the plane and its pixels truly are when sound is slower on its way than
    /// the scanner assumes. In tissue it is `probe_from_image` and the setting's spacing; in water rows are closer
    /// together, and the first one, half a pixel under the window's top, is less deep.
    pub fn seen_from_image(&self, setting: &Setting) -> (Pose<Probe, Image>, PixelSpacing) {
        let deep_per_m = 1.0 / self.subject.medium().shown_per_m();
        let over_m = setting.window_top_m + setting.spacing.y_m / 2.0;
        let up = Translation3::new(0.0, over_m * (deep_per_m - 1.0), 0.0);
        // FRAMES: the same axes, from the face down: the first row's centre is only so deep.
        let nearer = Pose::<Image, Image>::assume(Isometry3::from_parts(up, UnitQuaternion::identity()));
        let spacing = PixelSpacing { x_m: setting.spacing.x_m, y_m: setting.spacing.y_m * deep_per_m };
        (self.probe_from_image(setting) * nearer, spacing)
    }

    /// Where the wire phantom truly stands, where there is one.
    pub fn world_from_phantom(&self) -> Option<Pose<World, Phantom>> {
        self.subject.tank().map(|tank| *tank.world_from_phantom())
    }

    /// An image stamped t belongs to the pose at t + lag.
    pub fn lag(&self) -> Span {
        Span::from_nanoseconds(self.nominal.image_latency.nanoseconds() - self.image_latency.nanoseconds())
    }

    /// How long a B-scan truly takes to arrive.
    pub const fn image_latency(&self) -> Span {
        self.image_latency
    }

    /// Everything that was, tick by tick, from the world's beginning.
    pub fn moments(&self) -> Vec<Moment> {
        self.scene.lock().moments().copied().collect()
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
