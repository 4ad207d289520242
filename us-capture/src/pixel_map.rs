//! [`PixelMap`]: where the pixels of an image lie, straight from a calibration's matrix.

use std::fmt;
use std::marker::PhantomData;

use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Frame, Image, Point, Pose};
use thiserror::Error;

use crate::PixelSpacing;

/// Where pixels lie in `F`: the centre of the first, and the steps from column to column and from row to row (m).
///
/// Calibrations of PLUS are affine: the pixel's size is inside, and often a shear of one to three degrees. A
/// [`Pose`] is rigid, so a `PixelMap` keeps the calibration as it is, and says how far the rigid split is from it.
#[derive(Clone, Copy, PartialEq)]
pub struct PixelMap<F> {
    origin: Vector3<f64>,
    column: Vector3<f64>,
    row: Vector3<f64>,
    system: PhantomData<fn() -> F>,
}

/// A matrix that places no image.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BadPixelMap {
    /// A number is NaN or infinite, or the last row is not `0 0 0 1`.
    #[error("the matrix of the image has a number that is not finite, or its last row is not 0 0 0 1")]
    NotAffine,
    /// Columns and rows do not span a plane.
    #[error("the image's axes do not span a plane: a column is {column_mm:.3e} mm, a row {row_mm:.3e} mm")]
    Flat {
        /// Length of a column's step (mm).
        column_mm: f64,
        /// Length of a row's step (mm).
        row_mm: f64,
    },
    /// A left-handed matrix.
    #[error(
        "the image's matrix mirrors (determinant {determinant:.3e}): the orientation of the images or a sign is wrong"
    )]
    Mirrored {
        /// Determinant of its 3x3 part.
        determinant: f64,
    },
    /// Too far from a right angle to be split into a pose and a spacing.
    #[error(
        "columns and rows are {sheared_deg:.2} degrees from a right angle, {limit_deg:.2} are allowed: \
         no rigid pose holds them"
    )]
    Sheared {
        /// Angle between columns and rows, less 90 degrees.
        sheared_deg: f64,
        /// The limit asked for.
        limit_deg: f64,
    },
}

impl<F: Frame> PixelMap<F> {
    /// The pixels of an image whose plane is at `pose`.
    pub fn of(pose: &Pose<F, Image>, spacing: PixelSpacing) -> Self {
        let axis = |vector: Vector3<f64>| pose.isometry().rotation * vector;
        Self::new(pose.origin(), axis(Vector3::x() * spacing.x_m), axis(Vector3::y() * spacing.y_m))
    }

    /// The pixels from `origin` with a step a column and a step a row (m).
    pub const fn new(origin: Point<F>, column: Vector3<f64>, row: Vector3<f64>) -> Self {
        Self { origin: origin.vector(), column, row, system: PhantomData }
    }

    /// The map of a matrix in millimetres that takes `(column, row, 0, 1)` to `F`, as PLUS's `ImageToProbe` does.
    ///
    /// # Errors
    /// When it is not affine, flat, or left-handed.
    pub fn from_matrix_mm(matrix: &Matrix4<f64>) -> Result<Self, BadPixelMap> {
        let last = matrix.row(3);
        let affine = last[0] == 0.0 && last[1] == 0.0 && last[2] == 0.0 && (last[3] - 1.0).abs() < 1e-9;
        if !affine || matrix.iter().any(|x| !x.is_finite()) {
            return Err(BadPixelMap::NotAffine);
        }
        let linear: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let (column, row): (Vector3<f64>, Vector3<f64>) = (linear.column(0).into(), linear.column(1).into());
        if column.cross(&row).norm() < 1e-3 * column.norm() * row.norm() || column.norm() * row.norm() < 1e-12
        {
            return Err(BadPixelMap::Flat { column_mm: column.norm(), row_mm: row.norm() });
        }
        // A third column of zeros says nothing about the side; one that disagrees says the matrix mirrors.
        if linear.determinant() < 0.0 {
            return Err(BadPixelMap::Mirrored { determinant: linear.determinant() });
        }
        let origin: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
        Ok(Self::new(Point::from_vector(origin * 1e-3), column * 1e-3, row * 1e-3))
    }

    /// Where the pixel at `column`, `row` lies; (0, 0) is the centre of the first.
    pub fn at(&self, column: f64, row: f64) -> Point<F> {
        Point::from_vector(self.origin + self.column * column + self.row * row)
    }

    /// The step from a column to the next (m).
    pub const fn column_step(&self) -> Vector3<f64> {
        self.column
    }

    /// The step from a row to the next (m).
    pub const fn row_step(&self) -> Vector3<f64> {
        self.row
    }

    /// The same pixels, written in `A`.
    pub fn placed<A: Frame>(&self, a_from_f: &Pose<A, F>) -> PixelMap<A> {
        let turn = a_from_f.isometry().rotation;
        PixelMap::new(*a_from_f * Point::from_vector(self.origin), turn * self.column, turn * self.row)
    }

    /// How far columns and rows are from a right angle (rad).
    pub fn shear_rad(&self) -> f64 {
        let cosine = self.column.dot(&self.row) / (self.column.norm() * self.row.norm());
        cosine.clamp(-1.0, 1.0).asin()
    }

    /// The rigid pose and spacing nearest to it: the shear is shared by both axes, the first pixel stays.
    pub fn nearest_rigid(&self) -> (Pose<F, Image>, PixelSpacing) {
        let (x, y) = (self.column.normalize(), self.row.normalize());
        let (sum, difference) = ((x + y).normalize(), (x - y).normalize());
        let (x, y) = ((sum + difference).normalize(), (sum - difference).normalize());
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
        let turn = UnitQuaternion::from_rotation_matrix(&turn);
        // FRAMES: its origin is the first pixel and its axes run along the columns and rows: the Image's definition.
        let pose = Pose::assume(Isometry3::from_parts(Translation3::from(self.origin), turn));
        (pose, PixelSpacing { x_m: self.column.dot(&x), y_m: self.row.dot(&y) })
    }

    /// The rigid pose and spacing, when it holds them.
    ///
    /// # Errors
    /// When columns and rows are more than `limit_rad` from a right angle.
    pub fn split(&self, limit_rad: f64) -> Result<(Pose<F, Image>, PixelSpacing), BadPixelMap> {
        let (sheared, limit_deg) = (self.shear_rad().abs(), limit_rad.to_degrees());
        if sheared > limit_rad {
            return Err(BadPixelMap::Sheared { sheared_deg: sheared.to_degrees(), limit_deg });
        }
        Ok(self.nearest_rigid())
    }

    /// How far the nearest rigid pose puts the worst pixel of a `width` x `height` image from where the map has it (m).
    pub fn off_rigid_m(&self, width: usize, height: usize) -> f64 {
        let (pose, spacing) = self.nearest_rigid();
        let (right, bottom) = (width.saturating_sub(1) as f64, height.saturating_sub(1) as f64);
        [(right, 0.0), (0.0, bottom), (right, bottom)]
            .map(|(u, v)| self.at(u, v).distance(&(pose * spacing.point(u, v))))
            .into_iter()
            .fold(0.0, f64::max)
    }
}

impl<F: Frame> fmt::Debug for PixelMap<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { origin, column, row, .. } = self;
        write!(f, "pixels in {}: first {origin:?}, column {column:?}, row {row:?} m", F::NAME)
    }
}
