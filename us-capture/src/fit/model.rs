//! One dot: how far it is from its wire, and how that changes with every parameter.

use nalgebra::{Isometry3, Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};

use probepath_frames::{Probe, Twist};

use super::parameters::{
    COLUMN_SCALE, LAG, PLACE_SHIFT, PLACE_TURN, ROW_SCALE, SHEAR, SHIFT, Step, TURN, Values,
};
use crate::PixelSpacing;
use crate::phantom::Wire;

/// A wire as a line, with two directions across it.
#[derive(Clone, Debug)]
pub(super) struct WireLine {
    through: Vector3<f64>,
    across: Matrix2x3<f64>,
}

impl WireLine {
    /// `None` when the wire has no length.
    pub(super) fn of(wire: &Wire) -> Option<Self> {
        let along = wire.run().try_normalize(1e-9)?;
        let thin = along.iamin();
        let first = along.cross(&Vector3::ith(thin, 1.0)).try_normalize(1e-9)?;
        let across = Matrix2x3::from_rows(&[first.transpose(), along.cross(&first).transpose()]);
        Some(Self { through: wire.front.vector(), across })
    }

    fn off(&self, point: &Vector3<f64>) -> Vector2<f64> {
        self.across * (point - self.through)
    }
}

/// Where the phantom nominally stands, and about what its correction turns.
#[derive(Clone, Debug)]
pub(super) struct Stand {
    pub(super) phantom_from_world: Isometry3<f64>,
    pub(super) middle: Vector3<f64>,
}

/// The chain from pixels to the phantom for one image.
pub(super) struct Chain<'a> {
    values: &'a Values,
    spacing: PixelSpacing,
    nominal: PixelSpacing,
    middle: Vector3<f64>,
    /// About the middle of the wires, corrected.
    phantom_from_probe: Isometry3<f64>,
    /// Rotations as matrices: every dot of the image is turned by them.
    turn: Matrix3<f64>,
    image_turn: Matrix3<f64>,
    place_turn: Matrix3<f64>,
}

/// A dot's residual and its derivatives, a row for each of the two directions across the wire (m).
pub(super) struct Row {
    pub(super) off: Vector2<f64>,
    pub(super) by: [Step; 2],
}

impl<'a> Chain<'a> {
    pub(super) fn new(
        values: &'a Values,
        nominal: PixelSpacing,
        stand: &Stand,
        world_from_probe: &Isometry3<f64>,
    ) -> Self {
        let to_middle = Isometry3::translation(-stand.middle.x, -stand.middle.y, -stand.middle.z);
        let place = values.place();
        let phantom_from_probe =
            place.inverse() * (to_middle * (stand.phantom_from_world * world_from_probe));
        Self {
            values,
            spacing: values.spacing(nominal),
            nominal,
            middle: stand.middle,
            turn: phantom_from_probe.rotation.to_rotation_matrix().into_inner(),
            image_turn: values.probe_from_image.rotation.to_rotation_matrix().into_inner(),
            place_turn: place.rotation.to_rotation_matrix().into_inner(),
            phantom_from_probe,
        }
    }

    fn in_image(&self, [column, row]: [f64; 2]) -> Vector3<f64> {
        let y = row * self.spacing.y_m;
        Vector3::new(column * self.spacing.x_m + self.values.shear * y, y, 0.0)
    }

    fn in_probe(&self, in_image: &Vector3<f64>) -> Vector3<f64> {
        self.image_turn * in_image + self.values.probe_from_image.translation.vector
    }

    /// From the middle of the wires.
    fn in_phantom(&self, in_probe: &Vector3<f64>) -> Vector3<f64> {
        self.turn * in_probe + self.phantom_from_probe.translation.vector
    }

    /// The vector from the wire, across it (m).
    pub(super) fn off(&self, at_px: [f64; 2], wire: &WireLine) -> Vector2<f64> {
        wire.off(&(self.in_phantom(&self.in_probe(&self.in_image(at_px))) + self.middle))
    }

    /// A dot's covariance as a covariance of that vector (m²).
    pub(super) fn covariance(&self, covariance_px2: &Matrix2<f64>, wire: &WireLine) -> Matrix2<f64> {
        let pixel = Matrix3x2::new(self.spacing.x_m, 0.0, 0.0, self.spacing.y_m, 0.0, 0.0);
        let step = wire.across * self.turn * self.image_turn * pixel;
        step * covariance_px2 * step.transpose()
    }

    /// The vector from the wire and its derivatives by every parameter.
    pub(super) fn row(&self, at_px: [f64; 2], wire: &WireLine, twist: &Twist<Probe>) -> Row {
        let in_image = self.in_image(at_px);
        let in_probe = self.in_probe(&in_image);
        let in_phantom = self.in_phantom(&in_probe);
        let velocity = twist.linear + twist.angular.cross(&in_probe);
        let by_probe = wire.across * self.turn;
        let by_image = by_probe * self.image_turn;
        let by = [0, 1].map(|k| {
            let (probe, image) = (by_probe.row(k).transpose(), by_image.row(k).transpose());
            let across = wire.across.row(k).transpose();
            self.derivatives(at_px, &in_image, (&probe, &image), (&across, &in_phantom), probe.dot(&velocity))
        });
        Row { off: wire.off(&(in_phantom + self.middle)), by }
    }

    /// `probe` and `image` are the derivatives by the point in those systems.
    fn derivatives(
        &self,
        [column, row]: [f64; 2],
        in_image: &Vector3<f64>,
        (probe, image): (&Vector3<f64>, &Vector3<f64>),
        (across, in_phantom): (&Vector3<f64>, &Vector3<f64>),
        by_lag: f64,
    ) -> Step {
        let mut by = Step::zeros();
        by.fixed_rows_mut::<3>(TURN).copy_from(&in_image.cross(image));
        by.fixed_rows_mut::<3>(SHIFT).copy_from(probe);
        by[COLUMN_SCALE] = image.x * column * self.nominal.x_m;
        by[ROW_SCALE] = (image.y + self.values.shear * image.x) * row * self.nominal.y_m;
        by[SHEAR] = image.x * in_image.y;
        by[LAG] = by_lag;
        by.fixed_rows_mut::<3>(PLACE_TURN).copy_from(&across.cross(in_phantom));
        by.fixed_rows_mut::<3>(PLACE_SHIFT).copy_from(&-(self.place_turn * across));
        by
    }
}
