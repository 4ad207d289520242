//! The outline of a section, as a closed polygon in its plane: circles inside it, widths, its length.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// How far the radius of the inscribed circle may be from the largest (m).
const CIRCLE_WITHIN_M: f64 = 2e-6;

/// A point of a section's plane (m).
pub(crate) type Flat = (f64, f64);

/// The largest circle inside a closed outline, however it is dented: centre and radius.
///
/// Branch and bound over squares: none inside a square is farther from the outline than its centre and half a
/// diagonal (V. Agafonkin, "polylabel", 2016; D. Garcia-Castellanos and U. Lombardo, "Poles of inaccessibility",
/// Scottish Geographical Journal 123, 2007). The radius is within 2 um of the largest.
pub(crate) fn inscribed_circle(outline: &[Flat], inside: Flat) -> (Flat, f64) {
    let low = outline.iter().fold((f64::INFINITY, f64::INFINITY), |a, p| (a.0.min(p.0), a.1.min(p.1)));
    let high =
        outline.iter().fold((f64::NEG_INFINITY, f64::NEG_INFINITY), |a, p| (a.0.max(p.0), a.1.max(p.1)));
    let half = 0.5 * (high.0 - low.0).max(high.1 - low.1);
    let mut best = (inside, clearance(outline, inside).max(0.0));
    if !(half.is_finite() && half > 0.0) {
        return best;
    }
    let middle = (0.5 * (low.0 + high.0), 0.5 * (low.1 + high.1));
    let mut open = BinaryHeap::from([Square::at(outline, middle, half)]);
    while let Some(square) = open.pop() {
        if square.bound() <= best.1 + CIRCLE_WITHIN_M {
            break;
        }
        for centre in square.quarters() {
            let quarter = Square::at(outline, centre, 0.5 * square.half);
            if quarter.clearance > best.1 {
                best = (centre, quarter.clearance);
            }
            if quarter.bound() > best.1 + CIRCLE_WITHIN_M {
                open.push(quarter);
            }
        }
    }
    best
}

/// A square of the plane, and how far its centre is from the outline.
struct Square {
    centre: Flat,
    half: f64,
    clearance: f64,
}

impl Square {
    fn at(outline: &[Flat], centre: Flat, half: f64) -> Self {
        Self { centre, half, clearance: clearance(outline, centre) }
    }

    /// No point of the square is farther from the outline.
    fn bound(&self) -> f64 {
        self.clearance + self.half * std::f64::consts::SQRT_2
    }

    fn quarters(&self) -> [Flat; 4] {
        let ((x, y), h) = (self.centre, 0.5 * self.half);
        [(x - h, y - h), (x + h, y - h), (x - h, y + h), (x + h, y + h)]
    }
}

impl Ord for Square {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound().total_cmp(&other.bound())
    }
}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Square {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Square {}

/// Distance of a point from the outline: positive inside, negative outside.
pub(crate) fn clearance(outline: &[Flat], (x, y): Flat) -> f64 {
    let (mut inside, mut nearest) = (false, f64::INFINITY);
    for (a, b) in edges(outline) {
        if (a.1 > y) != (b.1 > y) && x < (b.0 - a.0) * (y - a.1) / (b.1 - a.1) + a.0 {
            inside = !inside;
        }
        let (ex, ey) = (b.0 - a.0, b.1 - a.1);
        let length = ex * ex + ey * ey;
        let t = if length > 0.0 { (((x - a.0) * ex + (y - a.1) * ey) / length).clamp(0.0, 1.0) } else { 0.0 };
        let (dx, dy) = (x - a.0 - t * ex, y - a.1 - t * ey);
        nearest = nearest.min(dx * dx + dy * dy);
    }
    if inside { nearest.sqrt() } else { -nearest.sqrt() }
}

fn edges(outline: &[Flat]) -> impl Iterator<Item = (Flat, Flat)> + '_ {
    outline.iter().copied().zip(outline.iter().copied().cycle().skip(1))
}

/// Length of a closed outline whose points lie at equal angles on a curve: each chord stands for its arc.
pub(crate) fn length(outline: &[Flat]) -> f64 {
    let half = std::f64::consts::PI / outline.len().max(3) as f64;
    let chords: f64 = edges(outline).map(|(a, b)| squared(a, b).sqrt()).sum();
    chords * half / half.sin()
}

/// Smallest and largest width (Feret diameters): the smallest lies across an edge of the convex hull, the largest
/// between two of its corners (G. Toussaint, "Solving geometric problems with the rotating calipers", 1983).
pub(crate) fn widths(outline: &[Flat]) -> (f64, f64) {
    let hull = hull(outline);
    let corner = |k: usize| hull[k % hull.len()];
    let (mut least, mut largest, mut far) = (f64::INFINITY, 0.0_f64, 1);
    for (i, (a, b)) in edges(&hull).enumerate() {
        // Going round, the corner farthest from an edge only goes on; those it passes are opposite to the edge's first.
        far = far.max(i + 1);
        while far < i + hull.len() && off(a, b, corner(far + 1)) > off(a, b, corner(far)) {
            far += 1;
            largest = largest.max(squared(a, corner(far)));
        }
        least = least.min(off(a, b, corner(far)) / squared(a, b).sqrt());
        largest = largest.max(squared(a, corner(far))).max(squared(b, corner(far)));
    }
    (least.min(largest.sqrt()), largest.sqrt())
}

fn off(a: Flat, b: Flat, c: Flat) -> f64 {
    cross(a, b, c).abs()
}

fn squared(a: Flat, b: Flat) -> f64 {
    (b.0 - a.0) * (b.0 - a.0) + (b.1 - a.1) * (b.1 - a.1)
}

/// Twice the area of the triangle, positive when it turns left.
fn cross(a: Flat, b: Flat, c: Flat) -> f64 {
    (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
}

/// The corners of the convex hull (A. Andrew's monotone chains, 1979).
fn hull(outline: &[Flat]) -> Vec<Flat> {
    let mut points = outline.to_vec();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut corners = chain(points.iter().copied());
    corners.extend(chain(points.iter().rev().copied()));
    corners
}

/// The half of the hull that lies right of the way through the points, without its last corner.
fn chain(points: impl Iterator<Item = Flat>) -> Vec<Flat> {
    let mut corners: Vec<Flat> = Vec::new();
    for point in points {
        while let [.., a, b] = corners[..]
            && cross(a, b, point) <= 0.0
        {
            corners.pop();
        }
        corners.push(point);
    }
    corners.pop();
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::Dice;

    /// A star of random harmonics, dented as no vessel is.
    fn star(dice: &mut Dice, points: usize) -> Vec<Flat> {
        let parts: Vec<(f64, f64)> =
            (1..6).map(|k| (0.8e-3 * (dice.uniform() - 0.5) / f64::from(k), 6.3 * dice.uniform())).collect();
        let r = |angle: f64| {
            let wave =
                |(k, (a, phase)): (usize, &(f64, f64))| 2.0 * a * ((k + 1) as f64 * angle + phase).cos();
            (3e-3 + parts.iter().enumerate().map(wave).sum::<f64>()).max(0.3e-3)
        };
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / points as f64;
        (0..points).map(|i| (r(angle(i)) * angle(i).cos(), r(angle(i)) * angle(i).sin())).collect()
    }

    #[test]
    fn no_circle_on_a_fine_grid_is_larger_than_the_inscribed_one() {
        let mut dice = Dice(5);
        for case in 0..60 {
            let outline = star(&mut dice, 72);
            let (centre, radius) = inscribed_circle(&outline, (0.0, 0.0));
            assert!((clearance(&outline, centre) - radius).abs() < 1e-12, "{case}: it touches");
            let step = 0.05e-3;
            let grid = (-100..=100).flat_map(|i| (-100..=100).map(move |j| (f64::from(i), f64::from(j))));
            let brute = grid.map(|(i, j)| clearance(&outline, (i * step, j * step))).fold(0.0, f64::max);
            assert!(radius >= brute - CIRCLE_WITHIN_M, "{case}: {radius} {brute}");
            assert!(radius <= brute + step, "{case}: {radius} {brute}");
        }
    }

    #[test]
    fn the_circle_in_an_ellipse_has_its_small_axis_and_in_a_dumbbell_lies_in_the_larger_end() {
        let angle = |i: i32| std::f64::consts::TAU * f64::from(i) / 360.0;
        let ellipse: Vec<Flat> = (0..360).map(|i| (4e-3 * angle(i).cos(), 2e-3 * angle(i).sin())).collect();
        let (_, radius) = inscribed_circle(&ellipse, (1e-3, 0.0));
        assert!((radius - 2e-3).abs() < 5e-6, "{radius}");
        // Two rooms with a passage; the point given lies in the smaller.
        let dumbbell =
            [(-3.0, -1.0), (-1.0, -1.0), (-1.0, -0.2), (1.0, -0.2), (1.0, -2.0), (5.0, -2.0), (5.0, 2.0)]
                .into_iter()
                .chain([(1.0, 2.0), (1.0, 0.2), (-1.0, 0.2), (-1.0, 1.0), (-3.0, 1.0)])
                .map(|(x, y)| (x * 1e-3, y * 1e-3))
                .collect::<Vec<Flat>>();
        let (centre, radius) = inscribed_circle(&dumbbell, (-2e-3, 0.0));
        assert!((radius - 2e-3).abs() < 3e-6 && (centre.0 - 3e-3).abs() < 2e-5, "{radius} {centre:?}");
    }

    #[test]
    fn widths_are_those_of_every_direction_tried() {
        let mut dice = Dice(8);
        for case in 0..300 {
            let outline = star(&mut dice, 72);
            let (least, largest) = widths(&outline);
            let width = |k: i32| {
                let (sin, cos) = (std::f64::consts::PI * f64::from(k) / 2000.0).sin_cos();
                let along = outline.iter().map(|p| p.0 * cos + p.1 * sin);
                let (low, high) =
                    along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
                high - low
            };
            let (low, high) =
                (0..2000).map(width).fold((f64::INFINITY, 0.0_f64), |(a, b), w| (a.min(w), b.max(w)));
            assert!(least <= low + 1e-12 && low - least < 1e-5, "{case}: {least} {low}");
            assert!(largest >= high - 1e-12 && largest - high < 1e-8, "{case}: {largest} {high}");
        }
    }

    #[test]
    fn going_round_finds_the_widths_that_all_pairs_of_corners_have() {
        let mut dice = Dice(12);
        for case in 0..2000 {
            let around = 3 + case % 30;
            let point = |k: usize, r: f64| {
                let angle = std::f64::consts::TAU * k as f64 / around as f64;
                (r * angle.cos(), r * angle.sin())
            };
            // Every third is regular: parallel edges, corners equally far.
            let even = case % 3 == 0;
            let outline: Vec<Flat> =
                (0..around).map(|k| point(k, if even { 1.0 } else { 0.2 + dice.uniform() })).collect();
            let corners = hull(&outline);
            let far = |(a, b): (Flat, Flat)| {
                corners.iter().map(|p| off(a, b, *p) / squared(a, b).sqrt()).fold(0.0, f64::max)
            };
            let least = edges(&corners).map(far).fold(f64::INFINITY, f64::min);
            let pairs = outline.iter().flat_map(|a| outline.iter().map(|b| squared(*a, *b).sqrt()));
            let largest = pairs.fold(0.0, f64::max);
            let found = widths(&outline);
            assert!((found.0 - least).abs() < 1e-12 && (found.1 - largest).abs() < 1e-12, "{case}");
        }
    }

    #[test]
    fn the_length_of_a_circle_is_exact_and_of_an_ellipse_nearly() {
        let angle = |i: i32| std::f64::consts::TAU * f64::from(i) / 72.0;
        let ellipse = |a: f64, b: f64| -> Vec<Flat> {
            (0..72).map(|i| (a * angle(i).cos(), b * angle(i).sin())).collect()
        };
        assert!((length(&ellipse(2.0, 2.0)) - 4.0 * std::f64::consts::PI).abs() < 1e-12);
        // Ramanujan's second formula, good to 1e-6 here.
        let (a, b) = (3.0_f64, 2.0_f64);
        let h = ((a - b) / (a + b)).powi(2);
        let exact = std::f64::consts::PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
        assert!((length(&ellipse(a, b)) / exact - 1.0).abs() < 1e-3, "{}", length(&ellipse(a, b)));
    }

    #[test]
    fn a_point_and_a_line_have_no_circle_and_break_nothing() {
        assert!(inscribed_circle(&[], (0.0, 0.0)).1 <= 0.0);
        let point = [(1.0, 1.0); 5];
        assert!(inscribed_circle(&point, (1.0, 1.0)).1 <= 0.0);
        let line = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)];
        assert!(inscribed_circle(&line, (1.0, 0.0)).1 <= 1e-6);
        assert!(widths(&point).1 <= 0.0);
        assert!(inscribed_circle(&[(f64::NAN, 0.0), (1.0, f64::NAN), (0.0, 1.0)], (0.0, 0.0)).1.is_finite());
    }
}
