//! PLUS's own dots: labelled as PLUS labelled them, with clutter, with dots missing.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::{LabelOptions, Labeller, find_spacing};
use super::{named_dot, shipped, wrong_wires};
use crate::PixelSpacing;
use crate::dots::Dot;
use crate::phantom::WirePhantom;

/// The dots of every image that PLUS labelled, in the order of the phantom's wires (px).
fn labelled_by_plus(file: &str) -> Option<Vec<Vec<[f64; 2]>>> {
    let path = format!("{}/../../shared/data/plus/{file}", env!("CARGO_MANIFEST_DIR"));
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: {path} is not there");
        return None;
    };
    let document = roxmltree::Document::parse(&text).unwrap();
    let frames = document.descendants().filter(|n| n.has_tag_name("Frame"));
    let points = |frame: roxmltree::Node<'_, '_>| {
        let listed = frame.children().find(|n| n.has_tag_name("SegmentedPoints"))?;
        Some(listed.children().filter_map(|n| n.attribute("Position")).map(place).collect())
    };
    Some(frames.filter_map(points).collect())
}

fn place(text: &str) -> [f64; 2] {
    let mut numbers = text.split_whitespace().map(|x| x.parse().unwrap());
    [numbers.next().unwrap(), numbers.next().unwrap()]
}

/// What became of the images: the first choice is right (but for a false dot taken for a wire that is missing), or
/// another is, or none.
#[derive(Debug, Default)]
struct Tally {
    right: usize,
    later: usize,
    wrong: usize,
    refused: usize,
}

fn tally(set: &Set, images: &[Vec<[f64; 2]>], mut spoil: impl FnMut(Vec<Dot>) -> Vec<Dot>) -> Tally {
    let labeller = Labeller::new(&set.phantom, LabelOptions::default());
    let mut tally = Tally::default();
    for image in images {
        let named = image.iter().enumerate().map(|(wire, at)| named_dot(*at, 0.5, Some(wire)));
        let dots = spoil(named.collect());
        let Ok(found) = labeller.candidates(&dots, set.spacing) else {
            tally.refused += 1;
            continue;
        };
        match found.iter().position(|l| wrong_wires(l) == 0) {
            Some(0) => tally.right += 1,
            Some(_) => tally.later += 1,
            None => tally.wrong += 1,
        }
    }
    tally
}

struct Set {
    file: &'static str,
    phantom: WirePhantom,
    spacing: PixelSpacing,
}

fn sets() -> [Set; 2] {
    let set = |file, phantom, m| Set { file, phantom, spacing: PixelSpacing { x_m: m, y_m: m } };
    [
        set("FreehandCalibration3NWires.results.xml", shipped("fcal-1.2"), 78e-6),
        set("UsTemplateCalibration_3NWires.results.xml", shipped("ical-3n"), 145e-6),
    ]
}

/// `gone` of the wires' dots taken away, `clutter` dots that no wire made put in, and all of them in any order.
fn spoilt(mut dots: Vec<Dot>, gone: usize, clutter: usize, rng: &mut ChaCha8Rng) -> Vec<Dot> {
    dots.shuffle(rng);
    dots.truncate(dots.len() - gone);
    let mut anywhere = || [rng.random_range(30.0..790.0), rng.random_range(30.0..580.0)];
    dots.extend((0..clutter).map(|_| anywhere()).map(|at| named_dot(at, 0.6, None)).collect::<Vec<_>>());
    dots.shuffle(rng);
    dots
}

#[test]
fn plus_s_dots_get_plus_s_labels() {
    for set in sets() {
        let Some(images) = labelled_by_plus(set.file) else { return };
        let clean = tally(&set, &images, |dots| dots);
        assert_eq!(clean.right, images.len(), "{}: {clean:?}", set.file);
    }
}

#[test]
fn clutter_and_missing_dots_do_not_change_the_labels() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for set in sets() {
        let Some(images) = labelled_by_plus(set.file) else { return };
        let images: Vec<_> = images.into_iter().step_by(3).collect();
        for (gone, clutter, least) in
            [(0, 5, 0.98), (0, 15, 0.98), (1, 10, 0.96), (2, 0, 0.96), (2, 15, 0.95)]
        {
            let found = tally(&set, &images, |dots| spoilt(dots, gone, clutter, &mut rng));
            eprintln!("{} without {gone}, with {clutter}: {found:?}", set.file);
            assert!(found.right as f64 > least * images.len() as f64, "{}: {found:?}", set.file);
            assert_eq!(found.wrong, 0, "{}: {found:?}", set.file);
        }
    }
}

#[test]
fn an_unknown_pixel_size_is_found() {
    for set in sets() {
        let Some(images) = labelled_by_plus(set.file) else { return };
        let dots = |image: &Vec<[f64; 2]>| image.iter().map(|at| named_dot(*at, 0.5, None)).collect();
        let images: Vec<Vec<Dot>> = images.iter().step_by(20).map(dots).collect();
        let found = find_spacing(&set.phantom, &images, LabelOptions::default()).unwrap();
        let (x, y) = (found.x_m / set.spacing.x_m, found.y_m / set.spacing.y_m);
        eprintln!("{}: {x:.3} and {y:.3} of what PLUS was told", set.file);
        assert!((x - 1.0).abs() < 0.05 && (y - 1.0).abs() < 0.08, "{x} {y}");
    }
}
