//! A surface as a picture: a small z-buffer renderer without screen or GPU; orthographic, smoothly shaded, each pixel
//! the mean of nine.

use nalgebra::{Matrix3, Vector3};

use super::colours::Scale;
use super::picture::{Colour, Picture};

/// Triangles to be drawn.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceView<'a> {
    /// Vertices (mm, LPS).
    pub vertices_mm: &'a [[f64; 3]],
    /// Corners of each triangle.
    pub triangles: &'a [[u32; 3]],
    /// The number at each vertex that becomes a colour.
    pub values: &'a [f64],
    /// Which colour.
    pub scale: Scale,
}

/// Each pixel is drawn so many times, and its rows too.
const FINER: usize = 3;

/// From where the patient is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum From {
    /// From the front.
    Front,
    /// From the patient's right: there the head is on the left, as from the front.
    Right,
}

/// A rectangle of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Its first column.
    pub left: f64,
    /// Its first row.
    pub top: f64,
    /// Columns.
    pub width: f64,
    /// Rows.
    pub height: f64,
}

/// Where points of the surface land in the picture, so that marks can be drawn beside it.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    axes: Matrix3<f64>,
    centre: Vector3<f64>,
    /// Pixels a millimetre.
    pub scale: f64,
    middle: (f64, f64),
}

impl Camera {
    /// Looks at all vertices so that their longest extent runs across the window, head to the left.
    pub fn facing(vertices_mm: &[[f64; 3]], from: From, window: Window) -> Option<Self> {
        let points: Vec<Vector3<f64>> = vertices_mm.iter().map(|v| Vector3::from(*v)).collect();
        let axes = axes(&points, from)?;
        let empty = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let turned = points.iter().map(|p| axes * p);
        let (low, high) = turned.fold(empty, |(low, high), q| (low.inf(&q), high.sup(&q)));
        let size = high - low;
        let scale = (window.width / size.x.max(1e-6)).min(window.height / size.y.max(1e-6));
        let centre = axes.transpose() * ((low + high) / 2.0);
        let middle = (window.left + window.width / 2.0, window.top + window.height / 2.0);
        scale.is_finite().then_some(Self { axes, centre, scale, middle })
    }

    /// The same view with so many pixels a millimetre: two views of one size can be compared.
    #[must_use]
    pub fn with_scale(self, scale: f64) -> Self {
        Self { scale, ..self }
    }

    /// Column, row and depth (mm, larger is nearer) of a point (mm).
    pub fn project(&self, point_mm: [f64; 3]) -> (f64, f64, f64) {
        let q = self.axes * (Vector3::from(point_mm) - self.centre);
        (self.middle.0 + q.x * self.scale, self.middle.1 + q.y * self.scale, q.z)
    }

    /// What a direction of the patient is in the picture: columns and rows of its unit vector.
    pub fn direction(&self, along: [f64; 3]) -> (f64, f64) {
        let q = self.axes * Vector3::from(along);
        (q.x, q.y)
    }

    fn finer(self) -> Self {
        let times = FINER as f64;
        // Pixel centres lie on whole numbers.
        let place = |x: f64| (x + 0.5) * times - 0.5;
        Self { scale: self.scale * times, middle: (place(self.middle.0), place(self.middle.1)), ..self }
    }
}

/// Rows: right, down and toward the viewer. Right is the longest extent, head to the left.
fn axes(points: &[Vector3<f64>], from: From) -> Option<Matrix3<f64>> {
    if points.is_empty() {
        return None;
    }
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let covariance: Matrix3<f64> = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let eigen = covariance.symmetric_eigen();
    let mut right: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    if right.z > 0.0 {
        right = -right;
    }
    // LPS: from the front the patient's left (+x) is on the viewer's right, so with the head on the left it is up; from
    // the right the patient's back (+y) is down.
    let down = match from {
        From::Front => -Vector3::x(),
        From::Right => Vector3::y(),
    };
    let across = |toward: Vector3<f64>| (toward - right * right.dot(&toward)).try_normalize(1e-3);
    let down = across(down).or_else(|| across(Vector3::y())).or_else(|| across(Vector3::z()))?;
    // Right, down, away make a right-handed triple; the viewer is the other way.
    let toward = -right.cross(&down);
    Some(Matrix3::from_rows(&[right.transpose(), down.transpose(), toward.transpose()]))
}

/// Draws the surface over a picture.
pub fn render(picture: &mut Picture, view: &SurfaceView<'_>, camera: &Camera) {
    let fine = camera.finer();
    let screen: Vec<(f64, f64, f64)> = view.vertices_mm.iter().map(|v| fine.project(*v)).collect();
    let Some(mut canvas) = Canvas::round(&screen, picture) else { return };
    let normals = normals(view);
    for triangle in view.triangles {
        let corner = |i: u32| -> Option<Corner> {
            let i = i as usize;
            let normal = camera.axes * normals.get(i)?;
            Some(Corner {
                at: *screen.get(i)?,
                normal,
                value: view.values.get(i).copied().unwrap_or(f64::NAN),
            })
        };
        let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { continue };
        canvas.triangle(&[a, b, c], |value, normal| lit(view.scale.colour(value), normal));
    }
    canvas.lay(picture);
}

/// Draws triangles that lie flat in the picture, without light: columns, rows, and values at their corners.
pub fn flat(picture: &mut Picture, triangles: &[[(f64, f64, f64); 3]], scale: &Scale) {
    let times = FINER as f64;
    let place = |x: f64| (x + 0.5) * times - 0.5;
    let corner = |(x, y, value): (f64, f64, f64)| Corner {
        at: (place(x), place(y), 0.0),
        normal: Vector3::z(),
        value,
    };
    let all: Vec<[Corner; 3]> = triangles.iter().map(|triangle| triangle.map(corner)).collect();
    let screen: Vec<(f64, f64, f64)> = all.iter().flatten().map(|corner| corner.at).collect();
    let Some(mut canvas) = Canvas::round(&screen, picture) else { return };
    for triangle in &all {
        canvas.triangle(triangle, |value, _| scale.colour(value));
    }
    canvas.lay(picture);
}

/// The mean of the normals of the triangles at each vertex.
fn normals(view: &SurfaceView<'_>) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); view.vertices_mm.len()];
    for triangle in view.triangles {
        let place = |i: u32| view.vertices_mm.get(i as usize).map(|v| Vector3::from(*v));
        let [Some(a), Some(b), Some(c)] = triangle.map(place) else { continue };
        let normal = (b - a).cross(&(c - a));
        triangle.iter().for_each(|&i| normals[i as usize] += normal);
    }
    normals.iter().map(|normal| normal.try_normalize(1e-12).unwrap_or_default()).collect()
}

/// A colour in the light: from over the viewer's left shoulder, and a soft shine. Toward the viewer is +z, down +y.
fn lit(colour: Colour, normal: &Vector3<f64>) -> Colour {
    let Some(mut normal) = normal.try_normalize(1e-9) else { return colour };
    if normal.z < 0.0 {
        normal = -normal;
    }
    let light = Vector3::new(-0.35, -0.55, 0.76);
    let facing = normal.dot(&light).max(0.0);
    let half = (light + Vector3::z()).normalize();
    let shine = 46.0 * normal.dot(&half).max(0.0).powi(40);
    // Edges that turn away grow darker, so that the shape stands off the page.
    let body = 0.42 + 0.50 * facing + 0.10 * normal.z;
    colour.map(|level| (f64::from(level) * body + shine).clamp(0.0, 255.0) as u8)
}

#[derive(Clone, Copy)]
struct Corner {
    at: (f64, f64, f64),
    normal: Vector3<f64>,
    value: f64,
}

/// The part of a picture that is drawn in, finer than the picture, with the depth of what is nearest.
struct Canvas {
    first: (usize, usize),
    width: usize,
    height: usize,
    nearest: Vec<f64>,
    colours: Vec<Colour>,
}

impl Canvas {
    fn round(screen: &[(f64, f64, f64)], picture: &Picture) -> Option<Self> {
        let range = |pick: fn(&(f64, f64, f64)) -> f64, size: usize| {
            let values = screen.iter().map(pick);
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            let inside = |x: f64| (x / FINER as f64).clamp(0.0, size as f64) as usize;
            let (from, to) = (inside(low), (inside(high) + 2).min(size));
            (low.is_finite() && high.is_finite() && to > from).then_some((from, to - from))
        };
        let (left, width) = range(|p| p.0, picture.width())?;
        let (top, height) = range(|p| p.1, picture.height())?;
        let (width, height) = (width * FINER, height * FINER);
        let nearest = vec![f64::NEG_INFINITY; width * height];
        Some(Self { first: (left, top), width, height, nearest, colours: vec![[255; 3]; width * height] })
    }

    fn triangle(&mut self, corners: &[Corner; 3], colour: impl Fn(f64, &Vector3<f64>) -> Colour) {
        let shift = ((self.first.0 * FINER) as f64, (self.first.1 * FINER) as f64);
        let [a, b, c] = corners.map(|corner| (corner.at.0 - shift.0, corner.at.1 - shift.1, corner.at.2));
        let area = (b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1);
        if !area.is_finite() || area.abs() < 1e-9 {
            return;
        }
        let columns = bounds([a.0, b.0, c.0], self.width);
        for row in bounds([a.1, b.1, c.1], self.height) {
            for column in columns.clone() {
                let (x, y) = (column as f64, row as f64);
                let wb = ((x - a.0) * (c.1 - a.1) - (c.0 - a.0) * (y - a.1)) / area;
                let wc = ((b.0 - a.0) * (y - a.1) - (x - a.0) * (b.1 - a.1)) / area;
                let wa = 1.0 - wb - wc;
                if wa < -1e-9 || wb < -1e-9 || wc < -1e-9 {
                    continue;
                }
                let (depth, place) = (wa * a.2 + wb * b.2 + wc * c.2, row * self.width + column);
                if depth > self.nearest[place] {
                    self.nearest[place] = depth;
                    let weighed = corners.iter().zip([wa, wb, wc]);
                    let value = weighed.clone().map(|(corner, w)| corner.value * w).sum();
                    let normal: Vector3<f64> = weighed.map(|(corner, w)| corner.normal * w).sum();
                    self.colours[place] = colour(value, &normal);
                }
            }
        }
    }

    /// Mixes what was drawn into the picture.
    fn lay(&self, picture: &mut Picture) {
        let all = (FINER * FINER) as f64;
        for row in 0..self.height / FINER {
            for column in 0..self.width / FINER {
                let (mut sum, mut count) = ([0.0; 3], 0.0);
                for i in 0..FINER * FINER {
                    let (x, y) = (column * FINER + i % FINER, row * FINER + i / FINER);
                    let place = y * self.width + x;
                    if self.nearest[place] > f64::NEG_INFINITY {
                        count += 1.0;
                        sum.iter_mut().zip(self.colours[place]).for_each(|(s, level)| *s += f64::from(level));
                    }
                }
                if count > 0.0 {
                    let colour = sum.map(|s| (s / count) as u8);
                    let place = ((self.first.0 + column) as i64, (self.first.1 + row) as i64);
                    picture.mix(place.0, place.1, colour, count / all);
                }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A box along the body: 10 mm to the left, 20 mm to the back, from the head (z = 0) to z = -100.
    fn vertices() -> Vec<[f64; 3]> {
        (0..8)
            .map(|i| [f64::from(i & 1) * 10.0, f64::from(i >> 1 & 1) * 20.0, f64::from(i >> 2) * -100.0])
            .collect()
    }

    const WINDOW: Window = Window { left: 10.0, top: 5.0, width: 200.0, height: 80.0 };

    #[test]
    fn the_head_is_on_the_left_and_nothing_is_mirrored() {
        for (from, down, near) in [
            (From::Front, [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
            (From::Right, [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]),
        ] {
            let camera = Camera::facing(&vertices(), from, WINDOW).unwrap();
            assert!(camera.direction([0.0, 0.0, 1.0]).0 < -0.99, "{from:?}: the head is not on the left");
            assert!(camera.direction(down).1 > 0.99, "{from:?}");
            let middle = [5.0, 10.0, -50.0];
            let toward = [middle[0] + near[0], middle[1] + near[1], middle[2] + near[2]];
            assert!(camera.project(toward).2 > camera.project(middle).2 + 0.99, "{from:?}: seen from behind");
        }
    }

    #[test]
    fn what_is_nearer_hides_what_is_behind_and_the_edge_is_smooth() {
        let square = |y: f64, half: f64| {
            [(-half, 0.0), (half, 0.0), (half, -100.0), (-half, -100.0)].map(|(x, z)| [x, y, z])
        };
        let vertices: Vec<[f64; 3]> = [square(0.0, 5.0), square(-8.0, 2.03)].concat();
        let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let values = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        let scale = Scale::sequential(0.0, 1.0);
        let view = SurfaceView { vertices_mm: &vertices, triangles: &triangles, values: &values, scale };
        let camera = Camera::facing(&vertices, From::Front, WINDOW).unwrap();
        let mut picture = Picture::filled(220, 90, [255; 3]);
        render(&mut picture, &view, &camera);
        let column = |row: usize| picture.pixel(110, row);
        let (middle, side) = (column(45), column(45 + (3.5 * camera.scale) as usize));
        assert!(middle[0] < side[0], "the nearer square is the darker: {middle:?} {side:?}");
        assert_eq!(column(1), [255; 3]);
        let shades: std::collections::BTreeSet<u8> = (0..90).map(|row| column(row)[0]).collect();
        assert!(shades.len() > 3, "no smooth edge: {shades:?}");
    }
}
