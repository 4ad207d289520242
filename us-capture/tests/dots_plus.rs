//! Dots in real images, beside those that PLUS found (`../shared/data/plus`).

#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]
#![allow(clippy::print_stderr, reason = "a skipped test is seen, and so is what was found")]

use std::path::{Path, PathBuf};

use probepath_us_capture::dots::{Dot, DotFinder, DotSettings, Mask};
use probepath_us_capture::sequence::{ReadOptions, Sequence};
use roxmltree::{Document, Node};

/// The folder with the real files; `None`, said aloud, where it is absent.
fn plus() -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/plus"));
    if !folder.is_dir() {
        eprintln!("skipped: no folder ../shared/data/plus");
        return None;
    }
    Some(folder)
}

fn sequence(folder: &Path, name: &str) -> Sequence {
    Sequence::read(&folder.join(name).with_extension("igs.mha"), &ReadOptions::default()).unwrap()
}

/// The dots of every image, nothing known of it.
fn found(sequence: &Sequence) -> Vec<Vec<Dot>> {
    let (width, height) = (sequence.width(), sequence.height());
    let mut finder = DotFinder::new(DotSettings::default(), &Mask::whole(), width, height).unwrap();
    sequence.images().iter().map(|image| finder.find(image.picture().unwrap()).unwrap()).collect()
}

/// What PLUS labelled: image and centre (px).
fn labelled(folder: &Path, results: &str, half: &str) -> Vec<(usize, [f64; 2])> {
    let text = std::fs::read_to_string(folder.join(results)).unwrap();
    let document = Document::parse(&text).unwrap();
    let half = document.descendants().find(|node| node.has_tag_name(half)).unwrap();
    let frames = half.descendants().filter(|node| node.has_tag_name("Frame"));
    let number = |frame: &Node<'_, '_>| frame.attribute("Index").unwrap().parse::<usize>().unwrap();
    let points = |frame: Node<'_, '_>| -> Vec<(usize, [f64; 2])> {
        let points = frame.descendants().filter(|node| node.has_tag_name("Point"));
        points.map(|point| (number(&frame), position(&point))).collect()
    };
    frames.flat_map(points).collect()
}

fn position(point: &Node<'_, '_>) -> [f64; 2] {
    let numbers: Vec<f64> =
        point.attribute("Position").unwrap().split_whitespace().map(|x| x.parse().unwrap()).collect();
    [numbers[0], numbers[1]]
}

fn nearest(dots: &[Dot], at: [f64; 2]) -> f64 {
    dots.iter().map(|dot| (dot.at_px[0] - at[0]).hypot(dot.at_px[1] - at[1])).fold(f64::INFINITY, f64::min)
}

fn per_image(dots: &[Vec<Dot>]) -> f64 {
    dots.iter().map(Vec::len).sum::<usize>() as f64 / dots.len() as f64
}

/// Every dot that PLUS labelled is found, within 1.3 px root mean square, and few others are.
fn compare(name: &str, results: &str, half: &str) {
    let Some(folder) = plus() else { return };
    let found = found(&sequence(&folder, name));
    let offs: Vec<f64> =
        labelled(&folder, results, half).iter().map(|(image, at)| nearest(&found[*image], *at)).collect();
    let rms = (offs.iter().map(|off| off * off).sum::<f64>() / offs.len() as f64).sqrt();
    let worst = offs.iter().copied().fold(0.0, f64::max);
    let count = per_image(&found);
    eprintln!(
        "{name}: {} dots of PLUS, RMS {rms:.3} px, worst {worst:.2} px, {count:.1} found an image",
        offs.len()
    );
    assert!(offs.len() > 1600 && worst < 10.0 && rms < 1.0, "{rms} {worst}");
    assert!(offs.iter().filter(|off| **off > 3.0).count() <= 3);
    assert!(count < 18.0, "{count} dots an image, 9 to 11 are there");
}

#[test]
fn the_dots_of_fcal_are_those_of_plus() {
    compare("fCal_Test_Calibration_3NWires", "FreehandCalibration3NWires.results.xml", "CalibrationData");
    compare("fCal_Test_Validation_3NWires", "FreehandCalibration3NWires.results.xml", "ValidationData");
}

#[test]
fn the_dots_of_the_stepper_are_those_of_plus() {
    let results = "UsTemplateCalibration_3NWires.results.xml";
    compare("USTC_3NWires_RandomStepperMotionCalibration", results, "CalibrationData");
    compare("USTC_3NWires_RandomStepperMotionValidation", results, "ValidationData");
}

#[test]
fn few_other_things_are_dots() {
    let Some(folder) = plus() else { return };
    let sets = [
        ("NwirePhantomFreehand", 4.0, 12.0),
        ("USTC_3NWires_ProbeRotation", 9.0, 18.0),
        ("USTC_FrameGrabber_TemplateTranslationData", 6.0, 40.0),
        ("WaterTankBottomTranslationVideoBuffer", 0.0, 8.0),
        ("SpinePhantomFreehand", 0.0, 48.0),
    ];
    for (name, least, most) in sets {
        let count = per_image(&found(&sequence(&folder, name)));
        eprintln!("{name}: {count:.1} dots an image");
        assert!((least..=most).contains(&count), "{name}: {count}");
    }
}

/// Another depth, orientation, brightness: the dots are where they were.
#[test]
fn an_image_changed_as_scanners_do_shows_the_same_dots() {
    let Some(folder) = plus() else { return };
    let results = "FreehandCalibration3NWires.results.xml";
    let sequence = sequence(&folder, "fCal_Test_Validation_3NWires");
    let labelled = labelled(&folder, results, "ValidationData");
    let changes: [(&str, Change, f64); 8] = [
        ("mirrored", |image, size| remade(image, size, size, |[u, v]| [size[0] - 1 - u, v]), 1.0),
        ("turned upside down", |image, size| remade(image, size, size, |[u, v]| [u, size[1] - 1 - v]), 1.0),
        ("a quarter turn", |image, size| remade(image, size, [size[1], size[0]], |[u, v]| [v, u]), 1.0),
        ("3x enlarged", |image, size| remade(image, size, size.map(|x| 3 * x), |at| at.map(|x| x / 3)), 1.0),
        (
            "half the size",
            |image, size| remade(image, size, size.map(|x| x / 2), |at| at.map(|x| 2 * x)),
            0.99,
        ),
        ("dark", |image, size| (image.iter().map(|p| p / 4).collect(), size), 0.99),
        ("saturated", |image, size| (image.iter().map(|p| p.saturating_mul(3)).collect(), size), 0.97),
        ("noise", |image, size| (noisy(image), size), 0.97),
    ];
    for (name, change, part) in changes {
        let seen = seen_after(&sequence, &labelled, name, change);
        eprintln!("{name}: {:.2} % of the dots", seen * 100.0);
        assert!(seen >= part, "{name}: {seen}");
    }
}

type Change = fn(&[u8], [usize; 2]) -> (Vec<u8>, [usize; 2]);

/// An image of another size or orientation: where each of its pixels is taken from.
fn remade(
    image: &[u8],
    from: [usize; 2],
    to: [usize; 2],
    source: impl Fn([usize; 2]) -> [usize; 2],
) -> (Vec<u8>, [usize; 2]) {
    let at = |i: usize| source([i % to[0], i / to[0]]);
    ((0..to[0] * to[1]).map(|i| image[at(i)[1] * from[0] + at(i)[0]]).collect(), to)
}

/// Speckle of noise: Rayleigh amplitudes in decibels, at most a sixth of the range for the most part.
fn noisy(image: &[u8]) -> Vec<u8> {
    let mut state = 0x1234_5678_u32;
    let mut noise = |p: &u8| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let uniform = (f64::from(state >> 8) + 0.5) / f64::from(1 << 24);
        let level = 30.0 + 255.0 / 60.0 * 10.0 * (-uniform.ln()).log10();
        (*p).max(level.clamp(0.0, 255.0) as u8)
    };
    image.iter().map(&mut noise).collect()
}

/// The part of PLUS's dots, where the change puts them, that are found within 3 of the old pixels; every eighth image.
fn seen_after(sequence: &Sequence, labelled: &[(usize, [f64; 2])], name: &str, change: Change) -> f64 {
    let size = [sequence.width(), sequence.height()];
    let (mut seen, mut all) = (0, 0);
    for (number, image) in sequence.images().iter().enumerate().step_by(8) {
        let (changed, new) = change(image.picture().unwrap(), size);
        let mut finder = DotFinder::new(DotSettings::default(), &Mask::whole(), new[0], new[1]).unwrap();
        let dots = finder.find(&changed).unwrap();
        for (_, at) in labelled.iter().filter(|(image, _)| *image == number) {
            let (at, scale) = moved(name, *at, size);
            all += 1;
            seen += usize::from(nearest(&dots, at) < 3.0 * scale);
        }
    }
    f64::from(u32::try_from(seen).unwrap()) / f64::from(all)
}

/// Where a change puts a place, and how it scales lengths.
fn moved(name: &str, [u, v]: [f64; 2], [width, height]: [usize; 2]) -> ([f64; 2], f64) {
    match name {
        "mirrored" => ([width as f64 - 1.0 - u, v], 1.0),
        "turned upside down" => ([u, height as f64 - 1.0 - v], 1.0),
        "a quarter turn" => ([v, u], 1.0),
        "3x enlarged" => ([3.0 * u + 1.0, 3.0 * v + 1.0], 3.0),
        "half the size" => ([u / 2.0, v / 2.0], 0.5),
        _ => ([u, v], 1.0),
    }
}
