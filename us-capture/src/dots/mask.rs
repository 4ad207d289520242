//! [`Mask`]: where in the image dots are looked for.

use super::BadDots;

/// The part of the image that is looked at: all of it, a rectangle, a fan, or what several of them share.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mask {
    parts: Vec<Part>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Rectangle { column: f64, row: f64, width: f64, height: f64 },
    Fan { apex_px: [f64; 2], radii_px: [f64; 2], angles_rad: [f64; 2] },
}

impl Mask {
    /// The whole image.
    pub const fn whole() -> Self {
        Self { parts: Vec::new() }
    }

    /// The pixels from (`column`, `row`) on, `width` x `height` of them (PLUS's `ClipRectangleOrigin` and
    /// `ClipRectangleSize`).
    ///
    /// # Errors
    /// When a number is not finite or the size is not above zero.
    pub fn rectangle(column: f64, row: f64, width: f64, height: f64) -> Result<Self, BadDots> {
        let finite = [column, row, width, height].iter().all(|x| x.is_finite());
        if !finite || width <= 0.0 || height <= 0.0 {
            return Err(BadDots::Rectangle { column, row, width, height });
        }
        Ok(Self { parts: vec![Part::Rectangle { column, row, width, height }] })
    }

    /// What a curved probe sees: `radii_px` from the apex (column, row), `angles_deg` from straight down (more rows),
    /// growing toward more columns. (PLUS's `FanOriginPixel`, `FanRadiusStartPixel`, `FanRadiusStopPixel`,
    /// `FanAnglesDeg`.)
    ///
    /// # Errors
    /// When a number is not finite, the inner radius is not below the outer, or the angles do not grow.
    pub fn fan(apex_px: [f64; 2], radii_px: [f64; 2], angles_deg: [f64; 2]) -> Result<Self, BadDots> {
        let ([near_px, far_px], [from_deg, to_deg]) = (radii_px, angles_deg);
        let finite = apex_px.iter().chain(&radii_px).chain(&angles_deg).all(|x| x.is_finite());
        let ordered = 0.0 <= near_px && near_px < far_px && -180.0 <= from_deg && from_deg < to_deg;
        if !finite || !ordered || to_deg > 180.0 {
            return Err(BadDots::Fan { near_px, far_px, from_deg, to_deg });
        }
        let angles_rad = angles_deg.map(f64::to_radians);
        Ok(Self { parts: vec![Part::Fan { apex_px, radii_px, angles_rad }] })
    }

    /// What both leave.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.parts.extend(other.parts);
        self
    }

    /// Whether the centre of a pixel is inside.
    pub fn holds(&self, column: f64, row: f64) -> bool {
        self.parts.iter().all(|part| part.holds(column, row))
    }
}

impl Part {
    fn holds(&self, u: f64, v: f64) -> bool {
        match *self {
            Self::Rectangle { column, row, width, height } => {
                (column..column + width).contains(&u) && (row..row + height).contains(&v)
            }
            Self::Fan { apex_px, radii_px, angles_rad } => {
                let (x, y) = (u - apex_px[0], v - apex_px[1]);
                (radii_px[0]..=radii_px[1]).contains(&x.hypot(y))
                    && (angles_rad[0]..=angles_rad[1]).contains(&x.atan2(y))
            }
        }
    }
}
