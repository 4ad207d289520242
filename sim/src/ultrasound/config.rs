//! What the simulated machine is like, and what can be wrong with that.

use probepath_us_capture::Setting;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The machine's and the tissue's numbers (FIELD.md section 8). Echogenicities are amplitudes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImagingConfig {
    /// One scatterer lies in each cube of this edge, anywhere in it (m).
    pub lattice_m: f64,
    /// Echogenicity of blood.
    pub lumen: f64,
    /// Echogenicity of an artery's wall.
    pub wall: f64,
    /// Thickness of an artery's wall (m).
    pub wall_thickness_m: f64,
    /// Echogenicity of a vein's wall.
    pub vein_wall: f64,
    /// Thickness of a vein's wall (m).
    pub vein_wall_thickness_m: f64,
    /// Echogenicity of muscle and fat.
    pub tissue: f64,
    /// How unevenly muscle and fat echo: standard deviation (dB), over patches of `mottle_m`.
    pub mottle_db: f64,
    /// Size of those patches (m).
    pub mottle_m: f64,
    /// Full width at half maximum of the point spread along the beam (m).
    pub axial_fwhm_m: f64,
    /// The lateral width, as a multiple of the model's.
    pub lateral_factor: f64,
    /// The elevational width, as a multiple of the model's.
    pub elevational_factor: f64,
    /// Attenuation in the tissue (dB/cm/MHz), met on the way there and on the way back.
    pub attenuation_db_cm_mhz: f64,
    /// Frequency (MHz).
    pub frequency_mhz: f64,
    /// The most that the time gain compensation makes up for (dB).
    pub tgc_most_db: f64,
    /// Electronic noise where that compensation is at its most (dB re an echogenicity of one). It enters before the
    /// compensation, so that it is lower where less is made up for. The default is 56 dB below white.
    pub noise_db: f64,
    /// Overall gain (dB).
    pub gain_db: f64,
    /// What shows as white without gain (dB re an echogenicity of one).
    pub white_db: f64,
    /// From black to white (dB).
    pub dynamic_range_db: f64,
    /// Sectors behind something that swallows the beam.
    pub shadows: Vec<Shadow>,
    /// How squarely the beam has to meet a wire: the angle (degrees) at which its echo is down to 0.61.
    pub wire_specular_deg: f64,
    /// And a flat face.
    pub face_specular_deg: f64,
    /// How unevenly a wire echoes along its length: standard deviation (dB), over about a millimetre.
    pub wire_uneven_db: f64,
    /// Echoes of the skin that run to and fro under the probe.
    pub reverberation: Option<Reverberation>,
    /// A second echo behind that of every wire.
    pub double_echo: Option<DoubleEcho>,
    /// What the machine writes over its picture.
    pub overlay: Overlay,
}

/// An echo that ran to and fro in the wire, or the pulse's second swing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DoubleEcho {
    /// How far behind the first it shows (m).
    pub behind_m: f64,
    /// How much weaker it is (dB).
    pub loss_db: f64,
}

/// Bright bands across the whole picture, as far from one another as the skin's layers are thick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reverberation {
    /// From one band to the next (m); the first lies so deep.
    pub every_m: f64,
    /// Amplitude of the first (dB re an echogenicity of one).
    pub first_db: f64,
    /// How much weaker each is than the one before (dB).
    pub loss_db: f64,
}

/// What the machine writes over its picture, in white.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Overlay {
    /// The picture's number, in digits, at the top left.
    pub text: bool,
    /// Marks of depth every 5 mm down the right side.
    pub ruler: bool,
    /// A bright bar across the first rows (rows).
    pub bar_rows: usize,
}

/// Where echoes are lost behind a calcification or a bubble.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shadow {
    /// First and last place along the row, from the picture's first column (m).
    pub across_m: [f64; 2],
    /// Depth under the probe's face below which it falls (m).
    pub below_m: f64,
    /// What is lost (dB).
    pub loss_db: f64,
}

/// How the probe touches the skin, along the picture's row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// Not at all: air, no picture.
    None,
    /// All along the array.
    Full,
    /// From `from_m` to `to_m`, counted from the first column (m): the rest of the array looks into air.
    Between {
        /// Where contact begins (m).
        from_m: f64,
        /// Where it ends (m).
        to_m: f64,
    },
}

impl Contact {
    /// How much of the array's echo comes through at `x_m` (0 to 1), over an edge 1 mm wide.
    pub(super) fn coupling(&self, x_m: f64) -> f64 {
        match *self {
            Self::None => 0.0,
            Self::Full => 1.0,
            Self::Between { from_m, to_m } => (((x_m - from_m).min(to_m - x_m)) / 1e-3 + 0.5).clamp(0.0, 1.0),
        }
    }
}

impl Default for ImagingConfig {
    fn default() -> Self {
        Self {
            lattice_m: 0.35e-3,
            lumen: 0.02,
            wall: 1.2,
            wall_thickness_m: 0.8e-3,
            vein_wall: 0.6,
            vein_wall_thickness_m: 0.4e-3,
            tissue: 0.45,
            mottle_db: 1.5,
            mottle_m: 3.0e-3,
            axial_fwhm_m: 0.35e-3,
            lateral_factor: 1.0,
            elevational_factor: 1.0,
            attenuation_db_cm_mhz: 0.5,
            frequency_mhz: 10.0,
            tgc_most_db: 42.0,
            noise_db: -42.0,
            gain_db: 0.0,
            white_db: 14.0,
            dynamic_range_db: 60.0,
            shadows: Vec::new(),
            wire_specular_deg: 12.0,
            face_specular_deg: 6.0,
            wire_uneven_db: 1.0,
            reverberation: None,
            double_echo: None,
            overlay: Overlay::default(),
        }
    }
}

/// A machine that cannot be.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ImagingError {
    /// A number outside what makes sense.
    #[error("imaging: {what} is {value}, but has to lie between {least} and {most}")]
    Outside {
        /// The field's name.
        what: &'static str,
        /// What it was.
        value: f64,
        /// The least it may be.
        least: f64,
        /// The most it may be.
        most: f64,
    },
    /// A pose with a number that is not finite.
    #[error("imaging: the pose of the image plane in the World has a number that is not finite")]
    Pose,
}

fn within(what: &'static str, value: f64, least: f64, most: f64) -> Result<(), ImagingError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(ImagingError::Outside { what, value, least, most })
}

impl ImagingConfig {
    /// # Errors
    /// When a number is outside what makes sense, or NaN.
    pub(super) fn check(&self) -> Result<(), ImagingError> {
        within("lattice_m", self.lattice_m, 0.1e-3, 1e-3)?;
        for (what, echogenicity) in [
            ("lumen", self.lumen),
            ("wall", self.wall),
            ("vein_wall", self.vein_wall),
            ("tissue", self.tissue),
        ] {
            within(what, echogenicity, 0.0, 100.0)?;
        }
        within("wall_thickness_m", self.wall_thickness_m, 0.0, 5e-3)?;
        within("vein_wall_thickness_m", self.vein_wall_thickness_m, 0.0, 5e-3)?;
        within("mottle_db", self.mottle_db, 0.0, 20.0)?;
        within("mottle_m", self.mottle_m, 1e-3, 1.0)?;
        within("axial_fwhm_m", self.axial_fwhm_m, 0.1e-3, 3e-3)?;
        within("lateral_factor", self.lateral_factor, 0.2, 5.0)?;
        within("elevational_factor", self.elevational_factor, 0.1, 5.0)?;
        within("attenuation_db_cm_mhz", self.attenuation_db_cm_mhz, 0.0, 5.0)?;
        within("frequency_mhz", self.frequency_mhz, 0.5, 60.0)?;
        within("tgc_most_db", self.tgc_most_db, 0.0, 120.0)?;
        within("noise_db", self.noise_db, -300.0, 60.0)?;
        within("gain_db", self.gain_db, -60.0, 60.0)?;
        within("white_db", self.white_db, -60.0, 60.0)?;
        within("dynamic_range_db", self.dynamic_range_db, 10.0, 120.0)?;
        within("wire_specular_deg", self.wire_specular_deg, 1.0, 90.0)?;
        within("face_specular_deg", self.face_specular_deg, 1.0, 90.0)?;
        within("wire_uneven_db", self.wire_uneven_db, 0.0, 20.0)?;
        if let Some(bands) = self.reverberation {
            within("reverberation.every_m", bands.every_m, 0.5e-3, 50e-3)?;
            within("reverberation.first_db", bands.first_db, -120.0, 40.0)?;
            within("reverberation.loss_db", bands.loss_db, 0.1, 60.0)?;
        }
        let Some(double) = self.double_echo else { return Ok(()) };
        within("double_echo.behind_m", double.behind_m, 0.0, 20e-3)?;
        within("double_echo.loss_db", double.loss_db, 0.0, 120.0)
    }
}

/// # Errors
/// When the setting is not one that a picture can be made with.
pub(super) fn check_setting(setting: &Setting) -> Result<(), ImagingError> {
    within("depth_m", setting.depth_m, 5e-3, 0.3)?;
    within("focus_m", setting.focus_m, 1e-3, 0.3)?;
    within("window_top_m", setting.window_top_m, 0.0, 0.3)?;
    within("window_height_m", setting.window_height_m, 2e-3, 0.3)?;
    within("window_width_m", setting.window_width_m, 2e-3, 0.3)?;
    within("spacing.x_m", setting.spacing.x_m, 5e-6, 1e-3)?;
    within("spacing.y_m", setting.spacing.y_m, 5e-6, 1e-3)
}
