//! Drawn images of a calibration whose truth is known: blobs where the image's plane cuts the wires, clutter, noise.
#![allow(dead_code, reason = "tests and benchmarks each use a part")]
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::sync::Arc;

use probepath_frames::Pose;
use probepath_us_capture::fit::{PhantomPlace, Sighting};
use probepath_us_capture::shots::{Shot, Shots};
use probepath_us_capture::spatial::SpatialOptions;

use crate::calibration_truth::{Capture, Dice, Truth, captured, zs};

pub const SIZE: (usize, usize) = (820, 616);

/// A blob 3 px by 1.5 px, not longer than it can be seen.
fn blob(pixels: &mut [f64], at: [f64; 2], peak: f64) {
    for (dy, dx) in (-9_i32..=9).flat_map(|dy| (-12_i32..=12).map(move |dx| (dy, dx))) {
        let (column, row) = (at[0].round() + f64::from(dx), at[1].round() + f64::from(dy));
        if column < 0.0 || row < 0.0 || column >= SIZE.0 as f64 || row >= SIZE.1 as f64 {
            continue;
        }
        let (x, y) = ((column - at[0]) / 3.0, (row - at[1]) / 1.5);
        pixels[row as usize * SIZE.0 + column as usize] += peak * (-0.5 * (x * x + y * y)).exp();
    }
}

/// An image of these dots, with clutter that no wire made.
pub fn draw(dice: &mut Dice, sighting: &Sighting, clutter: usize) -> Arc<[u8]> {
    let mut pixels: Vec<f64> = (0..SIZE.0 * SIZE.1).map(|_| 6.0 + 3.0 * dice.between(-1.0, 1.0)).collect();
    for dot in &sighting.dots {
        blob(&mut pixels, dot.at_px, dice.between(90.0, 220.0));
    }
    for _ in 0..clutter {
        let at = [dice.between(0.0, SIZE.0 as f64), dice.between(0.0, SIZE.1 as f64)];
        blob(&mut pixels, at, dice.between(50.0, 200.0));
    }
    pixels.into_iter().map(|p| p.clamp(0.0, 255.0) as u8).collect()
}

/// The images of a whole recording.
pub fn shots(dice: &mut Dice, truth: &Truth, clutter: usize) -> Shots {
    let one = |sighting: &Sighting| {
        let (number, stamp) = (sighting.image as u64, sighting.stamp);
        Shot { number, stamp, pixels: Ok(draw(dice, sighting, clutter)) }
    };
    Shots::new(SIZE, truth.sightings.iter().map(one).collect(), truth.track.clone()).unwrap()
}

/// Three Zs one under the other, seen by a probe that tilts, with a tracker that errs.
pub fn truth(seed: u64, images: usize) -> (Dice, Truth) {
    let mut dice = Dice::new(seed);
    let phantom = zs(&mut dice, 3, 1);
    let capture = Capture { images, tracker: (5e-5, 3e-4), dot_px: 0.2, ..Capture::default() };
    let truth = captured(&mut dice, phantom, &capture);
    (dice, truth)
}

/// What somebody knows of it: the place about, the pixel as a scanner has it that takes water for tissue.
pub fn options(dice: &mut Dice, truth: &Truth) -> SpatialOptions {
    let off = Pose::assume(truth.world_from_phantom.isometry() * dice.motion(2e-4, 3e-3));
    let mut spacing = truth.spacing;
    spacing.y_m *= 1540.0 / 1482.0;
    SpatialOptions { spacing: Some(spacing), ..SpatialOptions::new(PhantomPlace::prior(off)) }
}
