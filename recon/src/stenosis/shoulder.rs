//! Where a narrowing begins and ends.

use super::place::Place;

/// A narrowing is bounded where the area is back at this part of the largest nearby.
const SHOULDER: f64 = 0.93;
/// Over this length the area is looked ahead for (mm).
const STRETCH_MM: f64 = 6.0;
/// How far a narrowing may reach on either side of its narrowest place (mm).
const REACH_MM: f64 = 30.0;
/// Sections farther apart than this leave a hole that nothing is said across (mm).
const HOLE_MM: f64 = 5.0;

/// An end of a narrowing.
pub(super) struct Shoulder {
    /// Its place among all places.
    pub(super) index: usize,
    /// Whether the vessel is wide again there; otherwise what was measured ends first.
    pub(super) reached: bool,
}

/// Both ends of the narrowing whose narrowest place is `narrowest`.
pub(super) fn shoulders(places: &[Place], narrowest: usize) -> [Shoulder; 2] {
    let before: Vec<usize> = near(places, (0..narrowest).rev(), narrowest);
    let after: Vec<usize> = near(places, narrowest + 1..places.len(), narrowest);
    [shoulder(places, &before, narrowest), shoulder(places, &after, narrowest)]
}

/// Those within reach, up to the first hole.
fn near(places: &[Place], outward: impl Iterator<Item = usize>, from: usize) -> Vec<usize> {
    let from = places[from].at;
    let mut last = from;
    outward
        .take_while(|&i| {
            let at = places[i].at;
            let joined = (at - last).abs() < HOLE_MM && (at - from).abs() <= REACH_MM;
            last = at;
            joined
        })
        .collect()
}

/// Where the area, going outward, is first back at what it reaches there before it narrows again.
fn shoulder(places: &[Place], outward: &[usize], narrowest: usize) -> Shoulder {
    let least = places[narrowest];
    let area = |i: usize| places[i].smooth;
    // The next narrowing ends this one: past the top, where the area has fallen by half of what it rose.
    let mut top = least.smooth;
    let until = outward.iter().position(|&i| {
        top = top.max(area(i));
        area(i) < top - 0.5 * (top - least.smooth) && top > 1.2 * least.smooth
    });
    let own = &outward[..until.unwrap_or(outward.len())];
    let largest = own.iter().map(|&i| area(i)).fold(least.smooth, f64::max);
    // Half of what was lost is back, and the next stretch brings hardly more: beyond a branch the vessel may be of
    // another size altogether, and that is no part of this narrowing.
    let half = least.smooth + 0.5 * (largest - least.smooth);
    let ended = own.iter().enumerate().find(|&(k, &i)| {
        let stretch =
            own[k..].iter().take_while(|&&next| (places[next].at - places[i].at).abs() <= STRETCH_MM);
        area(i) >= half && area(i) >= SHOULDER * stretch.map(|&next| area(next)).fold(0.0, f64::max)
    });
    // The last place of all is its own stretch: that the area is "back" there says nothing.
    let open = |i: usize| i > 0 && i + 1 < places.len();
    ended.map_or(Shoulder { index: narrowest, reached: false }, |(_, &index)| Shoulder {
        index,
        reached: open(index),
    })
}
