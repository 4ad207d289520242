//! The area curve: area of the lumen along its centreline, with its 95 % band, stenoses and their references marked.

use super::colours::{FAINT, INK, MARK, SOFT};
use super::drawing::Drawing;
use super::picture::Anchor;

/// A place on the curve that is marked and labelled.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Distance along the centreline (mm).
    pub at_mm: f64,
    /// Where the narrowing begins and ends (mm).
    pub span_mm: (f64, f64),
    /// What stands beside it.
    pub label: String,
}

/// A point of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Distance along the centreline (mm).
    pub at_mm: f64,
    /// Area (mm2); not finite where nothing is known.
    pub area_mm2: f64,
    /// Its 95 % interval (mm2).
    pub band_mm2: Option<[f64; 2]>,
}

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 280.0;
const LEFT: f64 = 52.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 42.0;
const LETTERS: f64 = 12.0;
/// Nothing is drawn higher than this part of the range above the open lumen, so that one wild section does not flatten
/// the rest.
const HEADROOM: f64 = 1.10;

/// From numbers to places of the drawing.
struct Axes {
    start: f64,
    end: f64,
    most: f64,
}

impl Axes {
    fn of(points: &[CurvePoint]) -> Self {
        let finite = || points.iter().filter(|p| p.at_mm.is_finite() && p.area_mm2.is_finite());
        let end = finite().map(|p| p.at_mm).fold(1.0, f64::max);
        let start = finite().map(|p| p.at_mm).fold(end, f64::min);
        let most = finite().map(|p| p.area_mm2).fold(1.0, f64::max) * HEADROOM;
        Self { start, end, most }
    }

    fn x(&self, at: f64) -> f64 {
        LEFT + (at - self.start) / (self.end - self.start).max(1e-9) * (WIDTH - LEFT - RIGHT)
    }

    fn y(&self, area: f64) -> f64 {
        HEIGHT - BOTTOM - (area / self.most).clamp(0.0, 1.0) * (HEIGHT - TOP - BOTTOM)
    }
}

/// The curve through points in the order given; points that are not finite break it.
pub fn area_curve(points: &[CurvePoint], marks: &[Mark]) -> Drawing {
    let axes = Axes::of(points);
    let title = "lumen area along the centreline".into();
    let mut drawing = Drawing { size: (WIDTH, HEIGHT), title, shapes: Vec::new() };
    spans(&mut drawing, &axes, marks);
    grid(&mut drawing, &axes);
    for run in points.split(|p| !(p.at_mm.is_finite() && p.area_mm2.is_finite())) {
        band(&mut drawing, &axes, run);
    }
    for mark in marks {
        let at = axes.x(mark.at_mm);
        drawing.dashes(&[(at, TOP), (at, HEIGHT - BOTTOM)], 1.0, MARK);
        drawing.text((at, TOP - 9.0), &mark.label, LETTERS + 1.0, Anchor::Middle, MARK);
    }
    for run in points.split(|p| !(p.at_mm.is_finite() && p.area_mm2.is_finite())) {
        let line: Vec<_> = run.iter().map(|p| (axes.x(p.at_mm), axes.y(p.area_mm2))).collect();
        if line.len() > 1 {
            drawing.line(&line, 2.0, INK);
        }
    }
    drawing
}

/// Where the narrowings begin and end.
fn spans(drawing: &mut Drawing, axes: &Axes, marks: &[Mark]) {
    for mark in marks {
        let (a, b) = (axes.x(mark.span_mm.0.max(axes.start)), axes.x(mark.span_mm.1.min(axes.end)));
        let (top, foot) = (TOP, HEIGHT - BOTTOM);
        drawing.area(&[(a, top), (b, top), (b, foot), (a, foot)], MARK, 0.07);
    }
}

fn band(drawing: &mut Drawing, axes: &Axes, run: &[CurvePoint]) {
    let known: Vec<_> = run.iter().filter_map(|p| Some((axes.x(p.at_mm), p.band_mm2?))).collect();
    let there = known.iter().map(|(x, [_, high])| (*x, axes.y(*high)));
    let back = known.iter().rev().map(|(x, [low, _])| (*x, axes.y(*low)));
    let outline: Vec<(f64, f64)> = there.chain(back).collect();
    if outline.len() > 3 {
        drawing.area(&outline, MARK, 0.28);
    }
}

fn grid(drawing: &mut Drawing, axes: &Axes) {
    let step = nice(axes.most / 5.0);
    for i in 0..=(axes.most / step) as usize {
        let area = i as f64 * step;
        let at = axes.y(area);
        drawing.line(&[(LEFT, at), (WIDTH - RIGHT, at)], 1.0, FAINT);
        drawing.text((LEFT - 8.0, at + 4.0), &format!("{area:.0}"), LETTERS, Anchor::End, SOFT);
    }
    let step = nice((axes.end - axes.start) / 8.0);
    for i in (axes.start / step).ceil() as i64..=(axes.end / step) as i64 {
        let at = i as f64 * step;
        let (x, foot) = (axes.x(at), HEIGHT - BOTTOM);
        drawing.line(&[(x, foot), (x, foot + 4.0)], 1.0, SOFT);
        drawing.text((x, foot + 17.0), &format!("{at:.0}"), LETTERS, Anchor::Middle, SOFT);
    }
    let middle = (LEFT + WIDTH - RIGHT) / 2.0;
    let below = "along the centreline from the proximal end, mm";
    drawing.text((middle, HEIGHT - 6.0), below, LETTERS, Anchor::Middle, SOFT);
    drawing.text((6.0, TOP - 11.0), "mm²", LETTERS, Anchor::Start, SOFT);
}

/// 1, 2 or 5 times a power of ten, at least `step`.
pub(super) fn nice(step: f64) -> f64 {
    let step = step.max(1e-6);
    let power = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= step * 0.999).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(areas: &[f64]) -> Vec<CurvePoint> {
        let point = |(at, area): (usize, &f64)| CurvePoint {
            at_mm: at as f64,
            area_mm2: *area,
            band_mm2: Some([area - 2.0, area + 2.0]),
        };
        areas.iter().enumerate().map(point).collect()
    }

    #[test]
    fn a_step_is_one_two_or_five() {
        for (rough, expected) in [(0.9, 1.0), (1.1, 2.0), (3.0, 5.0), (7.0, 10.0), (70.0, 100.0)] {
            assert!((nice(rough) - expected).abs() < 1e-9, "{rough}");
        }
    }

    #[test]
    fn a_hole_in_the_curve_stays_a_hole() {
        let svg = area_curve(&curve(&[50.0, 51.0, f64::NAN, 40.0, 41.0]), &[]).svg();
        assert_eq!(svg.matches("stroke-width='2'").count(), 2, "{svg}");
        assert_eq!(svg.matches("fill-opacity='0.28'").count(), 2, "{svg}");
    }

    #[test]
    fn a_curve_without_points_is_axes_alone() {
        let svg = area_curve(&[], &[]).svg();
        assert!(svg.contains("mm²") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
