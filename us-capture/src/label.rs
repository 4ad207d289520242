//! Labels: which wire made which dot.
//!
//! ```
//! use probepath_us_capture::label::{LabelOptions, Labeller};
//! # use probepath_us_capture::{PixelSpacing, dots::Dot, phantom::WirePhantom};
//! # fn show(phantom: &WirePhantom, dots: &[Dot]) -> Result<(), Box<dyn std::error::Error>> {
//! let labeller = Labeller::new(phantom, LabelOptions::default());
//! let spacing = PixelSpacing { x_m: 78e-6, y_m: 78e-6 };
//! let candidates = labeller.candidates(dots, spacing)?;
//! println!("best: {:.2} mm from the wires", candidates[0].rms_m * 1e3);
//! # Ok(()) }
//! ```
//!
//! A [`Labeller`] knows a phantom. Without any prediction it returns every choice of wires that explains the dots
//! ([`Labeller::candidates`]); with one, the choice near it ([`Labeller::near`]). Either way the answer is
//! [`Labels`], or a [`Refusal`] that says why.
//!
//! An image alone cannot tell a phantom from its symmetric twins, and, its plane having two sides, never a mirrored
//! image from one seen from behind: the poses of a sequence decide the first, what is known of the probe the second.

mod agree;
mod anchors;
mod assign;
mod near;
mod plane;
mod refusal;
mod search;
mod section;
mod seen;
mod spacing;
#[cfg(test)]
mod tests;

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion};
use probepath_frames::{Image, Phantom, Pose};

use crate::PixelSpacing;
use crate::dots::Dot;
use crate::phantom::WirePhantom;
pub use agree::{AgreeOptions, Agreement, Candidates, Expect, Flipped, agree};
use assign::{Window, Worth};
use nalgebra::Vector2;
use plane::{Belief, Match, Plane};
pub use refusal::Refusal;
use section::Section;
use seen::Seen;
pub use spacing::find_spacing;

/// The wires that made the dots of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Labels {
    /// For every wire of the phantom, in its order, the dot it made; `None` where it made none that was found.
    pub dots: Vec<Option<Dot>>,
    /// Where the image's plane lies in the phantom by these dots alone.
    pub phantom_from_image: Pose<Phantom, Image>,
    /// Root mean square distance of the dots from their wires with that pose (m).
    pub rms_m: f64,
    /// Logarithm of how much likelier the dots are as these wires' than as clutter: the higher the better.
    pub score: f64,
    /// Wires that should be seen at that pose, and made no dot that was found.
    pub missing: usize,
    /// By how much the pixels are larger than was said, by these dots alone: factors of x and y.
    pub scale: [f64; 2],
}

impl Labels {
    /// How many wires have a dot.
    pub fn count(&self) -> usize {
        self.dots.iter().flatten().count()
    }
}

/// What the labeller may take for granted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelOptions {
    /// The pixel size is right within this (standard deviation, relative): water is slower than scanners assume.
    pub scale_sd: f64,
    /// The image is across the wires within this (standard deviation, rad); three times as much is never assumed.
    pub tilt_sd_rad: f64,
    /// The wires are where the phantom's file says within this (standard deviation, m).
    pub place_sd_m: f64,
    /// The furthest a dot may be from its wire in the fit of one image (m).
    pub gate_m: f64,
    /// Where dots can be: first and last column and row that are looked at (px). `None`: around the dots.
    pub field_px: Option<[[f64; 2]; 2]>,
    /// How many dots, the first ones, first guesses are made of; all are used after that.
    pub anchors: usize,
}

impl Default for LabelOptions {
    fn default() -> Self {
        Self {
            scale_sd: 0.03,
            tilt_sd_rad: 0.2,
            place_sd_m: 0.25e-3,
            gate_m: 1.5e-3,
            field_px: None,
            anchors: 30,
        }
    }
}

/// Finds the wires that made the dots of an image.
#[derive(Clone, Debug)]
pub struct Labeller {
    name: String,
    section: Section,
    options: LabelOptions,
    belief: Belief,
    rounds: Vec<search::Round>,
}

/// A choice under work: the plane, its dots, its worth.
#[derive(Clone, Debug)]
struct Choice {
    plane: Plane,
    matches: Vec<Match>,
    worth: Worth,
}

impl Labeller {
    /// A labeller for a phantom; what can be worked out once is worked out here.
    pub fn new(phantom: &WirePhantom, options: LabelOptions) -> Self {
        let section = Section::of(phantom);
        let belief = Belief {
            tilt_sd: options.tilt_sd_rad.sin().max(0.02),
            scale_sd: options.scale_sd.max(1e-4),
            place_sd_m: options.place_sd_m.max(1e-6),
        };
        let rounds = search::rounds(&section);
        Self { name: phantom.name.clone(), section, options, belief, rounds }
    }

    /// Every choice of wires that explains the dots, the best first: with the phantom's symmetric twins, without
    /// anything improper (a mirrored assignment).
    ///
    /// # Errors
    /// When there are too few dots, or no plane explains them.
    pub fn candidates(&self, dots: &[Dot], spacing: PixelSpacing) -> Result<Vec<Labels>, Refusal> {
        let seen = self.enough(dots, spacing)?;
        let window = self.window(&seen, spacing);
        let choices = self.search(&seen, &window);
        let needed = self.needed(&window);
        let best = choices.first().map_or(f64::NEG_INFINITY, |c| c.worth.score);
        let good = choices.iter().filter(|c| c.worth.score > needed.max(best - 25.0) && self.is_enough(c));
        let labels: Vec<_> = good.map(|c| self.labels(c, dots, &seen)).collect();
        if labels.is_empty() {
            return Err(self.nothing(choices.first(), dots, spacing));
        }
        Ok(labels)
    }

    /// The one choice that explains the dots, when no other does nearly as well.
    ///
    /// # Errors
    /// As [`candidates`](Self::candidates), and when another choice explains the dots nearly as well.
    pub fn only(&self, dots: &[Dot], spacing: PixelSpacing) -> Result<Labels, Refusal> {
        let mut found = self.candidates(dots, spacing)?;
        let best = found.swap_remove(0);
        if let Some(other) = found
            .iter()
            .filter(|o| o.score > best.score - 8.0 && o.dots != best.dots)
            .min_by_key(|o| usize::MAX - o.count())
        {
            let (first, second) = (best.count(), other.count());
            return Err(Refusal::Ambiguous { dots: dots.len(), first, second });
        }
        Ok(best)
    }

    fn enough(&self, dots: &[Dot], spacing: PixelSpacing) -> Result<Vec<Seen>, Refusal> {
        let seen = seen::measured(dots, spacing)?;
        let (found, needed) = (dots.len(), self.least());
        if found == 0 {
            return Err(Refusal::NoDots);
        }
        if found < needed {
            return Err(Refusal::TooFewDots { found, needed });
        }
        let cut = dots.iter().filter(|d| d.cut).count();
        if found - cut < needed.min(3) {
            return Err(Refusal::AtEdge { dots: found, cut });
        }
        Ok(seen)
    }

    /// Fewest dots that say anything: one more than fix a plane, or all there can be.
    fn least(&self) -> usize {
        self.section.strands.len().clamp(3, 4)
    }

    fn is_enough(&self, choice: &Choice) -> bool {
        choice.matches.len() >= self.least() && choice.worth.missing * 2 <= choice.matches.len()
    }

    /// The score below which clutter could have made it: three dots fix a plane and prove nothing.
    fn needed(&self, window: &Window) -> f64 {
        let dot = (window.area() / (std::f64::consts::TAU * self.belief.place_sd_m.powi(2))).ln();
        if self.section.strands.len() == 3 { 2.0 * dot } else { 3.0 * dot + 2.0 }
    }

    fn window(&self, seen: &[Seen], spacing: PixelSpacing) -> Window {
        let metres = |p: [f64; 2]| Vector2::new(p[0] * spacing.x_m, p[1] * spacing.y_m);
        match self.options.field_px {
            Some([low, high]) => Window { low: metres(low), high: metres(high) },
            None => Window::around(seen),
        }
    }

    fn nothing(&self, best: Option<&Choice>, dots: &[Dot], spacing: PixelSpacing) -> Refusal {
        Refusal::NothingFits {
            phantom: self.name.clone(),
            dots: dots.len(),
            explained: best.map_or(0, |c| c.matches.len()),
            missing: best.map_or(0, |c| c.worth.missing),
            spacing_mm: (spacing.x_m + spacing.y_m) * 500.0,
        }
    }

    fn labels(&self, choice: &Choice, dots: &[Dot], seen: &[Seen]) -> Labels {
        let mut of_wire = vec![None; self.section.strands.len()];
        let mut squares = Vec::with_capacity(choice.matches.len());
        for (dot, wire) in assign::alone(&choice.plane, &self.section, &choice.matches) {
            of_wire[wire] = Some(dots[dot]);
            if !seen[dot].cut {
                squares.push(choice.plane.distance(&seen[dot], &self.section.strands[wire]).powi(2));
            }
        }
        Labels {
            dots: of_wire,
            phantom_from_image: self.pose(&choice.plane),
            rms_m: (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt(),
            score: choice.worth.score,
            missing: choice.worth.missing,
            scale: choice.plane.stretch.map(f64::exp).into(),
        }
    }

    fn pose(&self, plane: &Plane) -> Pose<Phantom, Image> {
        let axes = Rotation3::from_matrix_unchecked(self.section.axes.transpose());
        let turn = UnitQuaternion::from_rotation_matrix(&(axes * plane.turn));
        // FRAMES: the plane takes the image's metres to the section's axes, and those are the phantom's, turned.
        Pose::assume(Isometry3::from_parts(Translation3::from(axes * plane.origin), turn))
    }

    fn plane(&self, phantom_from_image: &Pose<Phantom, Image>) -> Plane {
        let axes = Rotation3::from_matrix_unchecked(self.section.axes);
        let pose = phantom_from_image.isometry();
        let turn = axes * pose.rotation.to_rotation_matrix();
        Plane { turn, origin: axes * pose.translation.vector, stretch: Vector2::zeros() }
    }
}
