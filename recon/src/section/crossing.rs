//! Sections that cross: where a vessel bends more sharply than it is wide, the planes normal to it meet inside it.

use nalgebra::Vector3;

use super::{Cut, OUTLINE, turns};

/// Which of the sections can stand side by side: going along, each that meets none kept before it. Those not `seen`
/// are nobody's neighbours.
pub(super) fn apart(cuts: &[Cut], seen: &[bool]) -> Vec<bool> {
    let mut kept: Vec<&Cut> = Vec::new();
    cuts.iter()
        .zip(seen)
        .map(|(cut, seen)| {
            let reach = 2.0 * largest(cut);
            let near = |other: &&&Cut| cut.centre.at_m - other.centre.at_m < reach;
            let free = !kept.iter().rev().take_while(near).any(|other| meet(other, cut));
            if free && *seen {
                kept.push(cut);
            }
            free
        })
        .collect()
}

fn largest(cut: &Cut) -> f64 {
    cut.radii.iter().copied().fold(0.0, f64::max)
}

/// Whether two sections, the first the nearer to the beginning, meet inside the lumen.
fn meet(first: &Cut, second: &Cut) -> bool {
    let (a, b) = (first.centre.tangent.vector(), second.centre.tangent.vector());
    let step = second.centre.point.vector() - first.centre.point.vector();
    // No point of one is nearer to the other's plane than its centre less this.
    let turned = (a - b).norm();
    if step.dot(&a) > turned * largest(second) && step.dot(&b) > turned * largest(first) {
        return false;
    }
    let behind = |cut: &Cut, of: &Cut, sign: f64| {
        outline(cut).any(|p| sign * (p - of.centre.point.vector()).dot(&of.centre.tangent.vector()) <= 0.0)
    };
    behind(second, first, 1.0) || behind(first, second, -1.0)
}

/// The outline in the World (m).
fn outline(cut: &Cut) -> impl Iterator<Item = Vector3<f64>> + '_ {
    let (centre, up, side) = (cut.centre.point.vector(), cut.centre.up.vector(), cut.centre.side.vector());
    (0..OUTLINE).zip(turns()).map(move |(k, (cos, sin))| centre + (up * *cos + side * *sin) * cut.radii[k])
}

#[cfg(test)]
mod tests {
    use probepath_frames::{Direction, Point};

    use super::*;
    use crate::centreline::CentrelinePoint;
    use crate::phantom_images::Dice;

    /// A place on a circle of the given radius (m), which turns toward World x.
    fn cut(at_m: f64, bend: f64, radius: f64) -> Cut {
        let (sin, cos) = (at_m / bend).sin_cos();
        let direction = |v: Vector3<f64>| Direction::of(v).expect("not zero");
        let tangent = direction(Vector3::new(sin, 0.0, cos));
        let up = direction(Vector3::new(cos, 0.0, -sin));
        let point = Point::from_vector(Vector3::new(1.0 - cos, 0.0, sin) * bend);
        let side = direction(tangent.vector().cross(&up.vector()));
        Cut { centre: CentrelinePoint { at_m, point, tangent, up, side }, radii: [radius; OUTLINE] }
    }

    #[test]
    fn sections_stand_on_a_bend_wider_than_the_lumen_and_meet_on_a_sharper_one() {
        let mut dice = Dice(4);
        for case in 0..2000 {
            let radius = 1e-3 + 4e-3 * dice.uniform();
            let ratio = 0.3 + 1.4 * dice.uniform();
            if (ratio - 1.0).abs() < 0.01 {
                continue;
            }
            let cuts: Vec<Cut> =
                (0..12).map(|i| cut(f64::from(i) * 0.5e-3, ratio * radius, radius)).collect();
            let apart = apart(&cuts, &[true; 12]);
            let all = apart.iter().all(|free| *free);
            assert_eq!(all, ratio > 1.0, "case {case}: bend {ratio} of the radius, {apart:?}");
            assert!(apart[0]);
        }
    }

    #[test]
    fn no_two_that_are_kept_share_a_point_of_the_lumen() {
        let mut dice = Dice(9);
        for case in 0..300 {
            let radius = 2e-3 + 2e-3 * dice.uniform();
            let cuts = winding(&mut dice, radius);
            let kept = apart(&cuts, &[true; 40]);
            let kept: Vec<&Cut> =
                cuts.iter().zip(kept).filter(|(_, free)| *free).map(|(cut, _)| cut).collect();
            for (i, first) in kept.iter().enumerate() {
                let near =
                    kept[i + 1..].iter().take_while(|c| c.centre.at_m - first.centre.at_m < 2.0 * radius);
                let ahead =
                    |p: Vector3<f64>| (p - first.centre.point.vector()).dot(&first.centre.tangent.vector());
                for second in near {
                    assert!(outline(second).all(|p| ahead(p) > 0.0), "case {case}");
                }
            }
        }
    }

    /// Places of a curve that bends now one way, now the other, now and then more sharply than the lumen is wide.
    fn winding(dice: &mut Dice, radius: f64) -> Vec<Cut> {
        let (mut place, mut heading) = (Vector3::zeros(), 0.0_f64);
        let mut bend = 0.0;
        (0..40)
            .map(|i| {
                if i % 6 == 0 {
                    bend = 3.0 * (dice.uniform() - 0.5) / radius;
                }
                heading += bend * 0.5e-3;
                let mut cut = cut(f64::from(i) * 0.5e-3, 1.0, radius);
                let turned = self::cut(heading, 1.0, radius).centre;
                place += turned.tangent.vector() * 0.5e-3;
                cut.centre =
                    CentrelinePoint { at_m: cut.centre.at_m, point: Point::from_vector(place), ..turned };
                cut
            })
            .collect()
    }

    #[test]
    fn what_no_image_shows_displaces_nothing() {
        let cuts: Vec<Cut> = (0..12).map(|i| cut(f64::from(i) * 0.5e-3, 2e-3, 4e-3)).collect();
        let mut seen = [true; 12];
        seen[0] = false;
        assert!(apart(&cuts, &seen)[1], "the first is no neighbour");
    }
}
