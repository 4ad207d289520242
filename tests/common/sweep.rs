//! Tracked sequences of a simulated vessel: transverse sweeps over the straight phantom, its lumen known exactly.

#![allow(dead_code, reason = "every test uses some of it")]

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Pose, Probe, Span, Stamp, World};
use probepath_recon::Mesh;
use probepath_sim::{Contact, ImagingConfig, PhantomConfig, Renderer, VascularPhantom, settings};
use probepath_us_capture::sequence::{Sequence, SequenceImage, Status, Tracked, TransformName};
use probepath_us_capture::{Calibration, CalibrationError, Setting};

/// A phantom, a machine, and the truth about the probe that nothing under test is told but through a calibration.
pub struct Sweep {
    pub phantom: VascularPhantom,
    pub setting: Setting,
    pub renderer: Renderer,
    pub probe_from_image: Pose<Probe, Image>,
}

impl Sweep {
    pub fn new(setting: Setting, seed: u64) -> Self {
        Self::over(VascularPhantom::new(&PhantomConfig::default()), setting, seed)
    }

    pub fn over(phantom: VascularPhantom, setting: Setting, seed: u64) -> Self {
        let turn = UnitQuaternion::from_euler_angles(1.5, 0.1, -0.2);
        Self {
            phantom,
            setting,
            renderer: Renderer::new(ImagingConfig::default(), seed).unwrap(),
            // FRAMES: anywhere; the calibration says where.
            probe_from_image: Pose::assume(Isometry3::from_parts(
                Translation3::new(-0.018, 0.003, 0.021),
                turn,
            )),
        }
    }

    /// The image's plane across the vessel at arc length `at_m`, the probe flat on the phantom's top.
    pub fn world_from_image(&self, at_m: f64) -> Pose<World, Image> {
        let centre = self.phantom.vessel().centre(at_m).vector();
        let first = Vector3::new(
            (self.setting.spacing.x_m - self.setting.window_width_m) / 2.0,
            self.phantom.top_y() + self.setting.window_top_m + self.setting.spacing.y_m / 2.0,
            centre.z,
        );
        // FRAMES: Image x is World x, Image y is World y (down), so Image z is World z.
        Pose::assume(Isometry3::from_parts(Translation3::from(first), UnitQuaternion::identity()))
    }

    /// Grey levels of the plane `world_from_image`.
    pub fn picture(&self, world_from_image: &Pose<World, Image>, number: u64) -> Vec<u8> {
        self.renderer.render(&self.phantom, world_from_image, &self.setting, Contact::Full, number).unwrap()
    }

    /// One image of a sequence, thirty a second.
    pub fn image(
        &self,
        world_from_image: &Pose<World, Image>,
        number: u64,
        pixels: Vec<u8>,
    ) -> SequenceImage {
        let world_from_probe = *world_from_image * self.probe_from_image.inverse();
        let mut matrix_mm = world_from_probe.isometry().to_homogeneous();
        matrix_mm.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e3);
        let pose = Tracked { matrix_mm, status: Status::Ok };
        SequenceImage {
            number,
            pixels: Some(pixels.into()),
            status: Status::Ok,
            stamp: Some(Stamp::ZERO + Span::from_seconds(number as f64 / 30.0)),
            transforms: BTreeMap::from([(TransformName::new("Probe", "Reference"), pose)]),
            fields: BTreeMap::new(),
        }
    }

    /// A sweep from `from_m` to `until_m` along the vessel, an image every `step_m`.
    pub fn sequence(&self, from_m: f64, until_m: f64, step_m: f64) -> Sequence {
        let mut sequence = Sequence::new(settings::COLUMNS, settings::ROWS);
        for number in 0..=((until_m - from_m) / step_m).round() as u64 {
            let place = self.world_from_image(from_m + number as f64 * step_m);
            let image = self.image(&place, number, self.picture(&place, number));
            sequence.push(image).unwrap();
        }
        sequence
    }

    /// The true lumen between two arc lengths (m).
    pub fn gold(&self, from_m: f64, until_m: f64) -> Mesh {
        let rings = ((until_m - from_m) / 0.5e-3).ceil() as usize;
        let grid = self.phantom.vessel().surface(from_m..until_m, rings, 72);
        Mesh::tube(&grid.points, (grid.along, grid.around))
    }

    pub fn calibration(&self) -> Calibration {
        Calibration {
            id: "the sweep's own".into(),
            date: "none".into(),
            phantom: "none: it is the truth".into(),
            probe_from_image: self.probe_from_image,
            setting: self.setting,
            image_lag: Span::ZERO,
            error: CalibrationError { rms_mm: 0.0, sd_mm: 0.0, held_out: false },
            quality: None,
        }
    }

    /// The same as PLUS writes it: the pixel's size is in the matrix (mm).
    pub fn plus_configuration(&self) -> String {
        let mut matrix: Matrix4<f64> = self.probe_from_image.isometry().to_homogeneous();
        matrix.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e3);
        let spacing = self.setting.spacing;
        matrix.column_mut(0).scale_mut(spacing.x_m * 1e3);
        matrix.column_mut(1).scale_mut(spacing.y_m * 1e3);
        let numbers: Vec<String> = matrix.transpose().iter().map(|x| format!("{x:.9}")).collect();
        format!(
            "<PlusConfiguration version=\"2.9\"><CoordinateDefinitions><Transform From=\"Image\" To=\"Probe\" \
             Matrix=\"{}\"/></CoordinateDefinitions></PlusConfiguration>",
            numbers.join(" ")
        )
    }
}
