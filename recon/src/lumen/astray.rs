//! Lumens that are none: what a sweep has once in a place cannot lie elsewhere there.
//!
//! A speckle hole may look like a lumen with a wall in one image, or in a few; the vessel looks so in all of them.
//! Lumens that follow from one another are a chain; where two chains disagree, the longer one is the vessel.

use nalgebra::Vector3;
use probepath_frames::Point;
use probepath_us_capture::PlacedBScan;

use super::again::{ASIDE_M, BETWEEN_M, Borders, seen};
use super::{NoLumen, track};

/// How far a vessel may run aside between two images, for each metre between them: some 25 degrees.
const SLOPE: f64 = 0.5;

/// A lumen of a chain: its image, and its centre in the World.
#[derive(Clone, Copy)]
struct Link {
    index: usize,
    centre: Vector3<f64>,
}

/// Lumens each of which lies where those before it let expect the vessel.
#[derive(Default)]
struct Chain {
    links: Vec<Link>,
    trail: Vec<Vector3<f64>>,
}

impl Chain {
    fn add(&mut self, link: Link) {
        self.links.push(link);
        self.trail.push(link.centre);
    }

    /// How far aside of what it lets expect a place in an image is (m); nothing when it has ended long before.
    fn aside(&self, image: &PlacedBScan, (x, y): (f64, f64)) -> Option<f64> {
        let place = track::predicted(image, &self.trail)?;
        let aside = (place.0 - x).hypot(place.1 - y);
        (aside < ASIDE_M && !track::far_from_trail(image, &self.trail, place)).then_some(aside)
    }

    /// The diagonal of the box round it (m): an arm that stands still makes no chain longer.
    fn extent(&self) -> f64 {
        let Some(first) = self.trail.first() else { return 0.0 };
        let (low, high) =
            self.trail.iter().fold((*first, *first), |(low, high), at| (low.inf(at), high.sup(at)));
        (high - low).norm()
    }
}

/// Refuses the accepted lumens of chains that a longer one contradicts. Whether there were any.
pub(super) fn refuse(images: &[PlacedBScan], borders: &mut Borders) -> bool {
    let mut chains = chains(images, borders);
    chains.sort_by(|a, b| b.extent().total_cmp(&a.extent()).then(b.links.len().cmp(&a.links.len())));
    let mut kept: Vec<Link> = Vec::with_capacity(images.len());
    let mut any = false;
    for chain in chains {
        let off: Vec<Option<f64>> =
            chain.links.iter().map(|link| contradicted(&images[link.index], link, &kept)).collect();
        if 2 * off.iter().flatten().count() <= off.len() {
            kept.extend(chain.links);
            continue;
        }
        any = true;
        let by_m = off.into_iter().flatten().fold(0.0, f64::max);
        for link in chain.links {
            borders[link.index] = Err(NoLumen::Jump { by_mm: by_m * 1e3 });
        }
    }
    any
}

/// The accepted lumens as chains.
fn chains(images: &[PlacedBScan], borders: &Borders) -> Vec<Chain> {
    let mut chains: Vec<Chain> = Vec::new();
    for (index, (image, border)) in images.iter().zip(borders).enumerate() {
        let Ok(border) = border else { continue };
        let (centre, _) = seen(image, border);
        let local = (image.world_from_image.inverse() * Point::from_vector(centre)).vector();
        let aside = |chain: &Chain| chain.aside(image, (local.x, local.y));
        let near = chains.iter().enumerate().filter_map(|(nth, chain)| Some((nth, aside(chain)?)));
        let nearest = near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(nth, _)| nth);
        let link = Link { index, centre };
        match nearest.and_then(|nth| chains.get_mut(nth)) {
            Some(chain) => chain.add(link),
            None => chains.push(Chain { links: vec![link], trail: vec![centre] }),
        }
    }
    chains
}

/// How far aside of the nearest other lumen along the sweep one is (m), when no vessel runs so.
fn contradicted(image: &PlacedBScan, link: &Link, kept: &[Link]) -> Option<f64> {
    let image_from_world = image.world_from_image.inverse();
    let here = (image_from_world * Point::from_vector(link.centre)).vector();
    let offsets =
        kept.iter().map(|other| (image_from_world * Point::from_vector(other.centre)).vector() - here);
    let nearest = offsets.min_by(|a, b| a.z.abs().total_cmp(&b.z.abs()))?;
    let (aside, along) = (nearest.xy().norm(), nearest.z.abs());
    (along < BETWEEN_M && aside > ASIDE_M + SLOPE * along).then_some(aside)
}
