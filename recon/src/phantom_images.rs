//! Seeded B-scans of a vessel whose lumen is known, for the tests here: speckle from random scatterers through a
//! separable Gaussian point spread, and log compression (FIELD.md section 8; Bamber and Dickinson 1980).

use probepath_frames::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Pose, Stamp};
use probepath_us_capture::{BScan, PixelSpacing, PlacedBScan, Setting};

/// A straight vessel along the World's x with stenoses, and how it echoes. Lengths in mm.
#[derive(Clone, Debug)]
pub struct Phantom {
    /// Radius where nothing is narrow.
    pub radius: f64,
    /// Depth of the axis under the probe's face.
    pub depth: f64,
    /// Place, length and area reduction (0 to 1) of each stenosis.
    pub stenoses: Vec<(f64, f64, f64)>,
    /// Echo amplitudes of lumen, wall and tissue.
    pub echoes: (f64, f64, f64),
    /// How thick the wall is.
    pub wall: f64,
    /// Columns, rows, height of the window.
    pub pixels: (usize, usize),
    /// Height and width of the window.
    pub window: (f64, f64),
    /// Electronic noise (dB under amplitude 1).
    pub noise_db: f64,
    /// Full widths: axial, lateral, elevational.
    pub spread: (f64, f64, f64),
    /// Half axes of the section relative to the radius: across, deep.
    pub oval: (f64, f64),
    /// Seed of the speckle.
    pub seed: u64,
    /// How far the axis lies off the picture's middle at x = 0.
    pub across: f64,
    /// How the axis runs aside, for each mm along x: across and deep.
    pub slope: (f64, f64),
    /// Overall gain (dB).
    pub gain_db: f64,
    /// Columns (mm from the middle) that lie in a shadow from a depth on, and what is lost there (dB).
    pub shadow: Option<Shadow>,
    /// Depths, thicknesses and echo amplitudes of bands that the machine draws over everything.
    pub bands: Vec<(f64, f64, f64)>,
    /// A vein.
    pub vein: Option<Vein>,
    /// A branch of the artery.
    pub branch: Option<Branch>,
}

/// A sector that echoes do not come back from.
#[derive(Clone, Copy, Debug)]
pub struct Shadow {
    /// Between these places across.
    pub across: (f64, f64),
    /// Below this depth.
    pub below: f64,
    /// What is lost (dB).
    pub loss_db: f64,
}

/// A vein beside the artery, along it. It has a wall of its own.
#[derive(Clone, Copy, Debug)]
pub struct Vein {
    /// From the artery's axis: across and deep.
    pub off: (f64, f64),
    /// Its radius.
    pub radius: f64,
    /// Thickness and echo amplitude of its wall.
    pub wall: (f64, f64),
}

/// A branch that leaves the axis.
#[derive(Clone, Copy, Debug)]
pub struct Branch {
    /// Where along x.
    pub at: f64,
    /// How fast it runs aside: across and deep for each mm along x.
    pub slope: (f64, f64),
    /// Its radius.
    pub radius: f64,
}

impl Default for Phantom {
    fn default() -> Self {
        Self {
            radius: 3.935,
            depth: 34.0,
            stenoses: vec![(40.0, 20.0, 0.80), (90.0, 20.0, 0.75)],
            echoes: (0.02, 1.2, 0.45),
            wall: 0.8,
            pixels: (320, 240),
            window: (30.0, 40.0),
            noise_db: -54.0,
            spread: (0.35, 1.69, 3.0),
            oval: (1.0, 1.0),
            seed: 1,
            across: 0.0,
            slope: (0.0, 0.0),
            gain_db: 0.0,
            shadow: None,
            bands: Vec::new(),
            vein: None,
            branch: None,
        }
    }
}

/// Uniform numbers of a 64-bit counter (splitmix64).
pub struct Dice(pub u64);

impl Dice {
    /// The next number in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Two independent normal numbers.
    pub fn normal_pair(&mut self) -> (f64, f64) {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        let angle = std::f64::consts::TAU * self.uniform();
        (radius * angle.cos(), radius * angle.sin())
    }
}

impl Phantom {
    /// True radius at `x` mm along the vessel.
    pub fn radius_at(&self, x: f64) -> f64 {
        let mut radius = self.radius;
        for &(at, length, area) in &self.stenoses {
            if (x - at).abs() <= length / 2.0 {
                let depth = self.radius * (1.0 - (1.0 - area).sqrt());
                radius -= depth * (1.0 + (std::f64::consts::TAU * (x - at) / length).cos()) / 2.0;
            }
        }
        radius
    }

    /// The machine's setting: 7 cm deep, focus 4.5 cm, the window centred on the vessel.
    pub fn setting(&self) -> Setting {
        let (height, width) = (self.window.0 * 1e-3, self.window.1 * 1e-3);
        Setting {
            depth_m: 0.07,
            focus_m: 0.045,
            window_top_m: (self.depth - self.window.0 / 2.0) * 1e-3,
            window_height_m: height,
            window_width_m: width,
            spacing: PixelSpacing { x_m: width / self.pixels.0 as f64, y_m: height / self.pixels.1 as f64 },
        }
    }

    /// Distance from the artery's border, positive outside (mm); straight vessels only are exact.
    pub fn distance(&self, x: f64, across: f64, depth: f64) -> f64 {
        let place = Vector3::new(x, across - self.across, depth - self.depth);
        let main = off_line(place, self.slope);
        let round = (main.y / self.oval.0).hypot(main.z / self.oval.1).hypot(main.x);
        let own = round - self.radius_at(x);
        match self.branch {
            Some(branch) if x > branch.at => {
                let from = place - Vector3::new(branch.at, 0.0, 0.0);
                own.min(off_line(from, branch.slope).norm() - branch.radius)
            }
            _ => own,
        }
    }

    /// The amplitude of the echo at a place.
    fn echo(&self, x: f64, across: f64, depth: f64) -> f64 {
        let artery = self.distance(x, across, depth);
        if artery < 0.0 {
            return self.echoes.0;
        }
        if artery < self.wall {
            return self.echoes.1;
        }
        let Some(vein) = self.vein else { return self.echoes.2 };
        let off = (across - self.across - vein.off.0).hypot(depth - self.depth - vein.off.1) - vein.radius;
        match off {
            off if off < 0.0 => self.echoes.0,
            off if off < vein.wall.0 => vein.wall.1,
            _ => self.echoes.2,
        }
    }

    /// The square of the echo, averaged over five planes across the beam, at `across`, `depth` mm.
    fn echo_power(&self, x: f64, across: f64, depth: f64) -> f64 {
        // Amplitudes add up, so it is the squared profile that weighs the power.
        let sigma = self.spread.2 / 2.3548 / 2_f64.sqrt();
        let (mut sum, mut weights) = (0.0, 0.0);
        for plane in -2..=2 {
            let offset = f64::from(plane);
            let weight = (-offset * offset / 2.0).exp();
            sum += weight * self.echo(x + offset * sigma, across, depth).powi(2);
            weights += weight;
        }
        let bands = self.bands.iter().filter(|band| (depth - band.0).abs() < band.1 / 2.0);
        let shadow = self.shadow.filter(|s| depth > s.below && (s.across.0..s.across.1).contains(&across));
        let kept = shadow.map_or(1.0, |shadow| 10_f64.powf(-shadow.loss_db / 10.0));
        (sum / weights + bands.map(|band| band.2 * band.2).sum::<f64>()) * kept
    }

    /// The B-scan at `x` mm along the vessel, as it lies in the World: x of the image across the vessel.
    pub fn bscan(&self, number: u64, x: f64) -> PlacedBScan {
        let (columns, rows) = self.pixels;
        let setting = self.setting();
        let spacing = (setting.spacing.x_m * 1e3, setting.spacing.y_m * 1e3);
        let mut dice = Dice(self.seed.wrapping_mul(1_000_003).wrapping_add(number));
        let mut field = vec![(0.0, 0.0); columns * rows];
        for (index, value) in field.iter_mut().enumerate() {
            let across = ((index % columns) as f64 - (columns - 1) as f64 / 2.0) * spacing.0;
            let depth = setting.window_top_m * 1e3 + (index / columns) as f64 * spacing.1;
            let echo = self.echo_power(x, across, depth).sqrt();
            let (re, im) = dice.normal_pair();
            *value = (re * echo, im * echo);
        }
        let lateral = taps(self.spread.1 / spacing.0);
        let axial = taps(self.spread.0 / spacing.1);
        field = blur(&field, &axial, rows, columns, columns, 1);
        field = blur(&field, &lateral, columns, rows, 1, columns);
        let pixels: Vec<u8> = field.iter().map(|&(re, im)| self.grey(re, im, &mut dice)).collect();
        let bscan = BScan::new(number, (Stamp::ZERO, Stamp::ZERO), setting, self.pixels, pixels)
            .expect("sizes agree");
        place(bscan, x, columns, spacing.0, setting.window_top_m)
    }

    fn grey(&self, re: f64, im: f64, dice: &mut Dice) -> u8 {
        let noise = 10_f64.powf(self.noise_db / 20.0);
        let (a, b) = dice.normal_pair();
        // Amplitude 1 of the echo is -12 dB of the range, which leaves room for bright speckle.
        let gain = 10_f64.powf(self.gain_db / 20.0);
        let envelope = gain * (re + a * noise).hypot(im + b * noise) / 2_f64.sqrt() * 0.25;
        ((20.0 * envelope.max(1e-9).log10() + 60.0) / 60.0 * 255.0).round().clamp(0.0, 255.0) as u8
    }
}

/// What of a place is off a line through the origin along (1, slope).
fn off_line(place: Vector3<f64>, slope: (f64, f64)) -> Vector3<f64> {
    let along = Vector3::new(1.0, slope.0, slope.1).normalize();
    place - along * place.dot(&along)
}

/// An image plane at `x` mm with its columns across (World -y to y) and its rows along World z, depth downward.
fn place(bscan: BScan, x: f64, columns: usize, pitch_mm: f64, top_m: f64) -> PlacedBScan {
    let half = (columns - 1) as f64 / 2.0 * pitch_mm * 1e-3;
    // FRAMES: image x along World y, image y along World z, image z along World x: a cyclic turn, right-handed.
    let turn = UnitQuaternion::from_axis_angle(
        &nalgebra::Unit::new_normalize(Vector3::new(1.0, 1.0, 1.0)),
        std::f64::consts::TAU / 3.0,
    );
    let world_from_image =
        Pose::assume(Isometry3::from_parts(Translation3::new(x * 1e-3, -half, top_m), turn));
    // FRAMES: the probe plays no part in these tests.
    let world_from_probe = Pose::assume(Isometry3::identity());
    PlacedBScan { bscan, world_from_probe, world_from_image, wrench: None }
}

/// A Gaussian of the given full width (in samples), of unit energy.
fn taps(full_width: f64) -> Vec<f64> {
    let sigma = full_width / 2.3548;
    let half = (3.5 * sigma).ceil() as i64;
    let taps: Vec<f64> =
        (-half..=half).map(|k| (-(k as f64).powi(2) / (2.0 * sigma * sigma)).exp()).collect();
    let energy = taps.iter().map(|tap| tap * tap).sum::<f64>().sqrt();
    taps.iter().map(|tap| tap / energy).collect()
}

/// `lines` lines of `length` samples, `step` apart, the lines `next` apart, convolved with `taps`.
fn blur(
    field: &[(f64, f64)],
    taps: &[f64],
    length: usize,
    lines: usize,
    step: usize,
    next: usize,
) -> Vec<(f64, f64)> {
    let half = taps.len() / 2;
    let mut out = vec![(0.0, 0.0); field.len()];
    for line in 0..lines {
        for i in 0..length {
            let (mut re, mut im) = (0.0, 0.0);
            for (k, tap) in taps.iter().enumerate() {
                // Mirrored at the edges: as much speckle there as anywhere.
                let at = (i + k).abs_diff(half);
                let at = if at >= length { 2 * length - 2 - at } else { at };
                let value = field[line * next + at * step];
                re += tap * value.0;
                im += tap * value.1;
            }
            out[line * next + i * step] = (re, im);
        }
    }
    out
}
