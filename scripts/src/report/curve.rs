//! The area curve as an inline SVG: area of the lumen along its centreline, stenoses marked.

use std::fmt::Write as _;

/// A place on the curve that is marked and labelled.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Distance along the centreline (mm).
    pub at_mm: f64,
    /// What stands beside it.
    pub label: String,
}

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 40.0;

/// The curve through `(at_mm, area_mm2)`, in the order given; points that are not finite break it.
pub fn area_curve(points: &[(f64, f64)], marks: &[Mark]) -> String {
    let finite = || points.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
    let longest = finite().map(|p| p.0).fold(1.0, f64::max);
    let start = finite().map(|p| p.0).fold(longest, f64::min);
    let most = finite().map(|p| p.1).fold(1.0, f64::max) * 1.08;
    let x = |at: f64| LEFT + (at - start) / (longest - start).max(1e-9) * (WIDTH - LEFT - RIGHT);
    let y = |area: f64| HEIGHT - BOTTOM - area / most * (HEIGHT - TOP - BOTTOM);
    let mut svg = format!(
        "<svg viewBox='0 0 {WIDTH} {HEIGHT}' role='img' aria-label='lumen area along the centreline'>"
    );
    axes(&mut svg, (start, longest), most, &x, &y);
    for mark in marks {
        let at = x(mark.at_mm);
        let _ = write!(
            svg,
            "<line class='mark' x1='{at:.1}' x2='{at:.1}' y1='{TOP}' y2='{:.1}'/><text class='mark' x='{at:.1}' y='{:.1}' \
             text-anchor='middle'>{}</text>",
            HEIGHT - BOTTOM,
            TOP - 7.0,
            super::html::escape(&mark.label)
        );
    }
    let _ = write!(svg, "<path class='area' d='{}'/></svg>", path(points, &x, &y));
    svg
}

fn path(points: &[(f64, f64)], x: &impl Fn(f64) -> f64, y: &impl Fn(f64) -> f64) -> String {
    let mut d = String::new();
    let mut pen = 'M';
    for &(at, area) in points {
        if !at.is_finite() || !area.is_finite() {
            pen = 'M';
            continue;
        }
        let _ = write!(d, "{pen}{:.1} {:.1}", x(at), y(area));
        pen = 'L';
    }
    d
}

fn axes(
    svg: &mut String,
    (start, end): (f64, f64),
    most: f64,
    x: &impl Fn(f64) -> f64,
    y: &impl Fn(f64) -> f64,
) {
    let step = nice(most / 5.0);
    for i in 0..=(most / step) as usize {
        let area = i as f64 * step;
        let at = y(area);
        let _ = write!(
            svg,
            "<line class='grid' x1='{LEFT}' x2='{:.1}' y1='{at:.1}' y2='{at:.1}'/><text x='{:.1}' y='{:.1}' \
             text-anchor='end'>{area:.0}</text>",
            WIDTH - RIGHT,
            LEFT - 6.0,
            at + 4.0
        );
    }
    let step = nice((end - start) / 8.0);
    let first = (start / step).ceil() as i64;
    for i in first..=(end / step) as i64 {
        let at = i as f64 * step;
        let _ = write!(
            svg,
            "<text x='{:.1}' y='{:.1}' text-anchor='middle'>{at:.0}</text>",
            x(at),
            HEIGHT - BOTTOM + 16.0
        );
    }
    let _ = write!(
        svg,
        "<text x='{:.1}' y='{:.1}' text-anchor='middle'>along the centreline, mm</text>\
         <text x='8' y='{:.1}'>mm²</text>",
        (LEFT + WIDTH - RIGHT) / 2.0,
        HEIGHT - 6.0,
        TOP - 7.0
    );
}

/// 1, 2 or 5 times a power of ten, at least `step`.
fn nice(step: f64) -> f64 {
    let step = step.max(1e-6);
    let power = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= step * 0.999).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_one_two_or_five() {
        for (rough, expected) in [(0.9, 1.0), (1.1, 2.0), (3.0, 5.0), (7.0, 10.0), (70.0, 100.0)] {
            assert!((nice(rough) - expected).abs() < 1e-9, "{rough}");
        }
    }

    #[test]
    fn a_hole_in_the_curve_stays_a_hole() {
        let svg = area_curve(&[(0.0, 50.0), (1.0, f64::NAN), (2.0, 40.0), (3.0, 41.0)], &[]);
        assert_eq!(svg.split("class='area'").nth(1).unwrap().matches('M').count(), 2, "{svg}");
    }
}
