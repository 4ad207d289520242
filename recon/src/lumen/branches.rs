//! Further arterial lumens: what the lumen that is followed opened into.
//!
//! A vein lies beside an artery along all its way; a branch was inside it a little earlier. So a second dark round
//! thing with a wall is a branch when its middle lies where the lumen lay in an image shortly before. From there on it
//! is followed as a vessel of its own, with its own number.

use std::collections::VecDeque;

use probepath_frames::{Image, Pose, World};
use probepath_us_capture::PlacedBScan;

use super::finder::Followed;
use super::seed::Corners;
use super::{Contour, ImageLumen, Look, seed, track};

/// How far back a branch may have been inside the lumen (m).
const BACK_M: f64 = 8e-3;
/// The lumen was at least so much larger there.
const LARGER: f64 = 1.15;
/// A branch that fewer images of a sweep show than this is none.
const LEAST_IMAGES: usize = 4;
/// Centres nearer than this are of one lumen (m).
const SAME_M: f64 = 1.5e-3;

/// Where the lumen lay in an image.
#[derive(Clone, Debug)]
struct Outline {
    image_from_world: Pose<Image, World>,
    points: Vec<(f64, f64)>,
    /// The box round the points.
    corners: Corners,
    area_mm2: f64,
}

impl Outline {
    fn of(image: &PlacedBScan, contour: &Contour) -> Self {
        let spacing = image.bscan.setting.spacing;
        let points: Vec<(f64, f64)> =
            contour.pixels.iter().map(|p| (p.0 * spacing.x_m, p.1 * spacing.y_m)).collect();
        let image_from_world = image.world_from_image.inverse();
        let corners = points.iter().map(|p| [*p, *p]).reduce(around).unwrap_or_default();
        Self { image_from_world, points, corners, area_mm2: contour.area_mm2 }
    }

    /// This outline beside another image.
    fn beside(&self, image: &PlacedBScan) -> Beside<'_> {
        Beside { outline: self, own_from_image: self.image_from_world * image.world_from_image }
    }

    fn holds(&self, place: (f64, f64)) -> bool {
        let [low, high] = self.corners;
        let near = (low.0..=high.0).contains(&place.0) && (low.1..=high.1).contains(&place.1);
        near && inside(&self.points, place)
    }
}

/// An outline, and how another image lies to its own.
struct Beside<'o> {
    outline: &'o Outline,
    own_from_image: Pose<Image, Image>,
}

impl Beside<'_> {
    /// Whether a place of the other image, seen along the outline's normal, is inside.
    fn holds(&self, place: (f64, f64)) -> bool {
        let here = (self.own_from_image * probepath_frames::Point::new(place.0, place.1, 0.0)).vector();
        self.outline.holds((here.x, here.y))
    }

    /// The box round it in the other image.
    fn corners(&self) -> Corners {
        let [low, high] = self.outline.corners;
        let image_from_own = self.own_from_image.inverse();
        let place = |(x, y): (f64, f64)| {
            let place = (image_from_own * probepath_frames::Point::new(x, y, 0.0)).vector();
            [(place.x, place.y); 2]
        };
        [(low.0, high.1), (high.0, low.1), high].map(place).into_iter().fold(place(low), around)
    }
}

/// The box round two boxes.
fn around(a: Corners, b: Corners) -> Corners {
    let [(low_a, high_a), (low_b, high_b)] = [(a[0], a[1]), (b[0], b[1])];
    [(low_a.0.min(low_b.0), low_a.1.min(low_b.1)), (high_a.0.max(high_b.0), high_a.1.max(high_b.1))]
}

/// Whether a place is inside a closed line (it is crossed an odd number of times on the way out).
fn inside(line: &[(f64, f64)], place: (f64, f64)) -> bool {
    let sides = line.iter().zip(line.iter().cycle().skip(1));
    let crossings = sides.filter(|(a, b)| {
        (a.1 > place.1) != (b.1 > place.1) && place.0 < a.0 + (place.1 - a.1) / (b.1 - a.1) * (b.0 - a.0)
    });
    crossings.count() % 2 == 1
}

/// The branches that are followed, image by image.
#[derive(Clone, Debug, Default)]
pub(super) struct Branches {
    outlines: VecDeque<Outline>,
    followed: Vec<(usize, Followed)>,
    known: usize,
}

impl Branches {
    /// The branches in an image, by their numbers, beside the lumen that is followed there.
    pub(super) fn find(
        &mut self,
        image: &PlacedBScan,
        main: Option<&Contour>,
        look: &Look<'_>,
    ) -> Vec<Contour> {
        let mut found = Vec::new();
        self.followed.retain_mut(|(number, vessel)| {
            let Some(place) = track::predicted(image, &vessel.trail) else { return false };
            if track::far_from_trail(image, &vessel.trail, place) {
                return false;
            }
            let contour = grown(image, look, vessel, place);
            let contour = contour.filter(|own| main.into_iter().chain(&found).all(|other| apart(own, other)));
            found.extend(contour.map(|contour| Contour { vessel: *number, ..contour }));
            true
        });
        let Some(main) = main else { return found };
        found.extend(self.born(image, main, &found, look));
        self.outlines.push_front(Outline::of(image, main));
        let centre = image.world_from_image.inverse() * main.centre;
        let near = |outline: &Outline| {
            let there = outline.image_from_world * (image.world_from_image * centre);
            there.vector().z.abs() < BACK_M
        };
        self.outlines.retain(near);
        self.outlines.truncate(MOST_OUTLINES);
        found
    }

    /// A branch that has just left the lumen.
    fn born(
        &mut self,
        image: &PlacedBScan,
        main: &Contour,
        known: &[Contour],
        look: &Look<'_>,
    ) -> Option<Contour> {
        let opened = |outline: &&Outline| outline.area_mm2 > LARGER * main.area_mm2;
        let wide: Vec<Beside<'_>> =
            self.outlines.iter().filter(opened).map(|outline| outline.beside(image)).collect();
        let within = wide.iter().map(Beside::corners).reduce(around)?;
        let own = Outline::of(image, main);
        let allowed =
            |place: (f64, f64)| !own.holds(place) && wide.iter().any(|outline| outline.holds(place));
        let place = seed::find(&image.bscan, look.table, look.settings, within, allowed).ok()?;
        let mut vessel = Followed::default();
        let contour = grown(image, look, &mut vessel, place)?;
        if !known.iter().chain([main]).all(|other| apart(&contour, other)) {
            return None;
        }
        self.known += 1;
        self.followed.push((self.known, vessel));
        Some(Contour { vessel: self.known, ..contour })
    }
}

/// An arm that stands still makes very many outlines of one place.
const MOST_OUTLINES: usize = 200;

fn grown(image: &PlacedBScan, look: &Look<'_>, vessel: &mut Followed, place: (f64, f64)) -> Option<Contour> {
    let region = track::grown(image, look.table, look.settings, place).ok()?;
    vessel.contour(image, &region, look).ok()
}

/// Whether two contours of one image are of two lumens.
fn apart(a: &Contour, b: &Contour) -> bool {
    a.centre.distance(&b.centre) * 1e3 > 0.8 * (a.radius_mm() + b.radius_mm())
}

/// The branches in every image of a sweep, looked for forward and backward: one that joins is one that leaves, seen
/// from the other end.
pub(super) fn in_sweep(images: &[PlacedBScan], look: &Look<'_>, found: &mut [ImageLumen]) {
    let there = || {
        let mut branches = Branches::default();
        let each = images.iter().zip(&*found);
        let seen = each.map(|(image, lumen)| branches.find(image, lumen.lumen.as_ref().ok(), look));
        let seen: Vec<Vec<Contour>> = seen.collect();
        (seen, branches.known)
    };
    let back = || {
        let mut branches = Branches::default();
        let each = images.iter().zip(&*found).enumerate().rev();
        let seen = each
            .map(|(index, (image, lumen))| (index, branches.find(image, lumen.lumen.as_ref().ok(), look)));
        seen.filter(|(_, others)| !others.is_empty()).collect()
    };
    let ((seen, known), again) = rayon::join(there, back);
    found.iter_mut().zip(seen).for_each(|(lumen, others)| lumen.others = others);
    join(found, again, known);
    drop_the_rare(found);
}

/// Adds what the way back found: under the number it has on the way there, where both see it, or under a new one.
fn join(found: &mut [ImageLumen], again: Vec<(usize, Vec<Contour>)>, known: usize) {
    let mut numbers = std::collections::BTreeMap::new();
    let same = |a: &Contour, b: &Contour| a.centre.distance(&b.centre) < SAME_M;
    for (index, others) in &again {
        for other in others {
            let twin = found.get(*index).and_then(|lumen| lumen.others.iter().find(|own| same(own, other)));
            if let Some(twin) = twin {
                numbers.entry(other.vessel).or_insert(twin.vessel);
            }
        }
    }
    for (index, others) in again {
        let Some(lumen) = found.get_mut(index) else { continue };
        for other in others {
            let vessel = numbers.get(&other.vessel).copied().unwrap_or(known + other.vessel);
            if lumen.others.iter().all(|own| own.vessel != vessel && apart(own, &other)) {
                lumen.others.push(Contour { vessel, ..other });
            }
        }
        lumen.others.sort_by_key(|contour| contour.vessel);
    }
}

fn drop_the_rare(found: &mut [ImageLumen]) {
    let mut counts = std::collections::BTreeMap::<usize, usize>::new();
    for contour in found.iter().flat_map(|lumen| &lumen.others) {
        *counts.entry(contour.vessel).or_default() += 1;
    }
    let often = |contour: &Contour| counts.get(&contour.vessel).is_some_and(|count| *count >= LEAST_IMAGES);
    found.iter_mut().for_each(|lumen| lumen.others.retain(often));
}
