//! The lumen surface as a picture: a small z-buffer renderer, orthographic, lit from the viewer.

use nalgebra::{Matrix3, Vector3};

use super::picture::{Colour, Picture};

/// Triangles to be drawn. Vertices in mm, LPS; `narrowing` per vertex: 0 open, 1 closed.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceView<'a> {
    /// Vertices (mm, LPS).
    pub vertices_mm: &'a [[f64; 3]],
    /// Corners of each triangle.
    pub triangles: &'a [[u32; 3]],
    /// How much of the reference area is lost at each vertex, 0 to 1.
    pub narrowing: &'a [f64],
}

const BACKGROUND: Colour = [255, 255, 255];
const MARGIN: f64 = 24.0;

/// Where points of the surface land in the picture, so that marks can be drawn beside it.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    axes: Matrix3<f64>,
    centre: Vector3<f64>,
    scale: f64,
    middle: (f64, f64),
}

impl Camera {
    /// Looks at all vertices so that their longest extent runs across the picture and the patient's front is up.
    pub fn facing(vertices_mm: &[[f64; 3]], width: usize, height: usize) -> Option<Self> {
        let points: Vec<Vector3<f64>> = vertices_mm.iter().map(|v| Vector3::from(*v)).collect();
        let axes = principal_axes(&points)?;
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for p in &points {
            let q = axes * p;
            low = low.inf(&q);
            high = high.sup(&q);
        }
        let size = high - low;
        let scale = ((width as f64 - 2.0 * MARGIN) / size.x.max(1e-6))
            .min((height as f64 - 2.0 * MARGIN) / size.y.max(1e-6));
        let centre = axes.transpose() * ((low + high) / 2.0);
        scale.is_finite().then_some(Self {
            axes,
            centre,
            scale,
            middle: (width as f64 / 2.0, height as f64 / 2.0),
        })
    }

    /// Column, row and depth (larger is nearer) of a point (mm).
    pub fn project(&self, point_mm: [f64; 3]) -> (f64, f64, f64) {
        let q = self.axes * (Vector3::from(point_mm) - self.centre);
        (self.middle.0 + q.x * self.scale, self.middle.1 + q.y * self.scale, q.z)
    }
}

/// Rows: right, down and toward the viewer. Right is the longest extent, head to the left; the view turns about it
/// a little so that the front and the side are both seen.
fn principal_axes(points: &[Vector3<f64>]) -> Option<Matrix3<f64>> {
    if points.is_empty() {
        return None;
    }
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let covariance: Matrix3<f64> = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let eigen = covariance.symmetric_eigen();
    let longest = eigen.eigenvalues.imax();
    let mut right: Vector3<f64> = eigen.eigenvectors.column(longest).into_owned();
    if right.z > 0.0 {
        right = -right;
    }
    // Posterior (+y) is down on the page; a patient seen from the front and a little from the side.
    let posterior = Vector3::new(0.45, 0.9, 0.0);
    let down = (posterior - right * right.dot(&posterior)).try_normalize(1e-9)?;
    let toward = down.cross(&right);
    Some(Matrix3::from_rows(&[right.transpose(), down.transpose(), toward.transpose()]))
}

/// Draws the surface; open lumen is red as blood, narrowing turns it dark violet.
pub fn render(view: &SurfaceView<'_>, camera: &Camera, width: usize, height: usize) -> Picture {
    let mut picture = Picture::filled(width, height, BACKGROUND);
    let mut nearest = vec![f64::NEG_INFINITY; width * height];
    let screen: Vec<(f64, f64, f64)> = view.vertices_mm.iter().map(|v| camera.project(*v)).collect();
    for triangle in view.triangles {
        let Some(corners) = corners(triangle, &screen, view.narrowing) else { continue };
        fill(&mut picture, &mut nearest, &corners, camera.scale);
    }
    picture
}

/// A corner on the screen and how narrow the lumen is there.
type Corner = ((f64, f64, f64), f64);

fn corners(triangle: &[u32; 3], screen: &[(f64, f64, f64)], narrowing: &[f64]) -> Option<[Corner; 3]> {
    let at = |i: u32| {
        let i = i as usize;
        Some((*screen.get(i)?, narrowing.get(i).copied().unwrap_or(0.0)))
    };
    Some([at(triangle[0])?, at(triangle[1])?, at(triangle[2])?])
}

fn fill(picture: &mut Picture, nearest: &mut [f64], corners: &[Corner; 3], scale: f64) {
    let [a, b, c] = corners.map(|(p, _)| p);
    let area = (b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1);
    if !area.is_finite() || area.abs() < 1e-9 {
        return;
    }
    let light = brightness(a, b, c, scale);
    let columns = bounds([a.0, b.0, c.0], picture.width());
    let rows = bounds([a.1, b.1, c.1], picture.height());
    for row in rows {
        for column in columns.clone() {
            let (x, y) = (column as f64, row as f64);
            let wb = ((x - a.0) * (c.1 - a.1) - (c.0 - a.0) * (y - a.1)) / area;
            let wc = ((b.0 - a.0) * (y - a.1) - (x - a.0) * (b.1 - a.1)) / area;
            let wa = 1.0 - wb - wc;
            if wa < -1e-9 || wb < -1e-9 || wc < -1e-9 {
                continue;
            }
            let depth = wa * a.2 + wb * b.2 + wc * c.2;
            let place = row * picture.width() + column;
            if depth > nearest[place] {
                nearest[place] = depth;
                let narrow = wa * corners[0].1 + wb * corners[1].1 + wc * corners[2].1;
                picture.set(column as i64, row as i64, shade(narrow, light));
            }
        }
    }
}

fn bounds(values: [f64; 3], size: usize) -> std::ops::Range<usize> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min).floor().clamp(0.0, size as f64);
    let high =
        (values.iter().copied().fold(f64::NEG_INFINITY, f64::max).ceil() + 1.0).clamp(0.0, size as f64);
    low as usize..high as usize
}

fn brightness(a: (f64, f64, f64), b: (f64, f64, f64), c: (f64, f64, f64), scale: f64) -> f64 {
    let u = Vector3::new((b.0 - a.0) / scale, (b.1 - a.1) / scale, b.2 - a.2);
    let v = Vector3::new((c.0 - a.0) / scale, (c.1 - a.1) / scale, c.2 - a.2);
    let normal = u.cross(&v);
    let light = Vector3::new(-0.3, -0.5, 0.81);
    0.30 + 0.70 * (normal.dot(&light) / (normal.norm() * light.norm()).max(1e-12)).abs()
}

/// Colour of the surface: from red (open) to dark violet (closed).
pub fn shade(narrowing: f64, light: f64) -> Colour {
    let t = narrowing.clamp(0.0, 1.0);
    let mix = |open: f64, closed: f64| ((open + t * (closed - open)) * light).clamp(0.0, 255.0) as u8;
    [mix(226.0, 70.0), mix(92.0, 20.0), mix(72.0, 150.0)]
}
