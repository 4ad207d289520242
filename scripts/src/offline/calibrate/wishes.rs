//! What can be asked of a calibration, read from the words of a command line.

use std::fmt::Display;
use std::str::FromStr;

use nalgebra::Matrix4;
use probepath_us_capture::PixelSpacing;
use probepath_us_capture::dots::Mask;
use probepath_us_capture::sequence::Orientation;

/// How the phantom's place in the reference system is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// As given.
    Fixed,
    /// As given, corrected a little by the wires themselves.
    Prior,
    /// From the wires alone.
    Unknown,
}

/// How the size of a pixel is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// As given.
    Known,
    /// Found, along both axes.
    Estimated,
    /// As given, but for the speed of sound in the phantom's water.
    Water,
}

/// The orientation of a file that does not say its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored(pub Orientation);

/// A part of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column and row.
    pub origin: [usize; 2],
    /// Columns and rows.
    pub size: [usize; 2],
}

/// What a curved probe sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fan {
    /// Its apex (column, row).
    pub apex_px: [f64; 2],
    /// First and last distance from the apex.
    pub radii_px: [f64; 2],
    /// First and last angle from straight down, growing toward more columns.
    pub angles_deg: [f64; 2],
}

/// The size of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelMm {
    /// From column to column (mm).
    pub x: f64,
    /// From row to row (mm).
    pub y: f64,
}

/// Where the phantom is: takes column vectors from the phantom's system to the reference's (mm).
#[derive(Clone, Debug, PartialEq)]
pub struct PhantomToReference(pub Matrix4<f64>);

impl PixelMm {
    /// In metres.
    pub const fn spacing(self) -> PixelSpacing {
        PixelSpacing { x_m: self.x / 1e3, y_m: self.y / 1e3 }
    }
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "fixed" => Ok(Self::Fixed),
            "prior" => Ok(Self::Prior),
            "unknown" => Ok(Self::Unknown),
            _ => Err("a phantom's place is fixed, prior or unknown".into()),
        }
    }
}

impl FromStr for Scale {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "known" => Ok(Self::Known),
            "estimated" => Ok(Self::Estimated),
            "water" => Ok(Self::Water),
            _ => Err("a pixel's size is known, estimated or water".into()),
        }
    }
}

impl FromStr for Stored {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Orientation::parse(Some(text)).map_err(|error| error.to_string())?;
        found.map(Self).ok_or_else(|| "an orientation is MF, UF, MN or UN".into())
    }
}

impl FromStr for Region {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = "a region is four whole numbers: first column, first row, columns, rows (27,27,766,562)";
        let &[x, y, width, height] = numbers::<usize>(text, wanted)?.as_slice() else {
            return Err(wanted.into());
        };
        if width == 0 || height == 0 {
            return Err(format!("a region of {width} x {height} pixels holds nothing; {wanted}"));
        }
        Ok(Self { origin: [x, y], size: [width, height] })
    }
}

impl FromStr for Fan {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = "a fan is six numbers: its apex (column, row), first and last distance from it (pixels), first and \
                      last angle from straight down (degrees): 410,-100,120,650,-35,35";
        let &[u, v, near, far, first, last] = finite(text, wanted)?.as_slice() else {
            return Err(wanted.into());
        };
        let fan = Self { apex_px: [u, v], radii_px: [near, far], angles_deg: [first, last] };
        Mask::fan(fan.apex_px, fan.radii_px, fan.angles_deg).map_err(|why| format!("{why}; {wanted}"))?;
        Ok(fan)
    }
}

impl FromStr for PixelMm {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = "a pixel's size is one or two positive numbers in mm (0.078 or 0.078,0.074)";
        let (x, y) = match *finite(text, wanted)?.as_slice() {
            [both] => (both, both),
            [x, y] => (x, y),
            _ => return Err(wanted.into()),
        };
        // Nobody builds a scanner whose pixels are a centimetre or a nanometre wide: that is another unit.
        if [x, y].iter().any(|size| !(1e-4..10.0).contains(size)) {
            return Err(format!("{text} mm is no pixel of a B-scan; {wanted}"));
        }
        Ok(Self { x, y })
    }
}

impl FromStr for PhantomToReference {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = "a phantom's place is a translation x,y,z in mm, or a matrix of 16 numbers row by row";
        let found = finite(text, wanted)?;
        match found.as_slice() {
            &[x, y, z] => Ok(Self(Matrix4::new_translation(&nalgebra::Vector3::new(x, y, z)))),
            sixteen if sixteen.len() == 16 => Ok(Self(Matrix4::from_row_slice(sixteen))),
            other => Err(format!("{} numbers were given; {wanted}", other.len())),
        }
    }
}

fn finite(text: &str, wanted: &str) -> Result<Vec<f64>, String> {
    let found = numbers::<f64>(text, wanted)?;
    if found.iter().all(|x| x.is_finite()) { Ok(found) } else { Err(wanted.into()) }
}

/// Numbers between commas or blanks.
fn numbers<T: FromStr<Err: Display>>(text: &str, wanted: &str) -> Result<Vec<T>, String> {
    let words = text.split([',', ' ']).map(str::trim).filter(|word| !word.is_empty());
    words.map(|word| word.parse().map_err(|why| format!("{word:?}: {why}; {wanted}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_translation_or_a_whole_matrix_places_the_phantom() {
        let place: PhantomToReference = "-29.7239,-79.1055,0".parse().unwrap();
        assert_eq!(place.0.column(3).as_slice(), [-29.7239, -79.1055, 0.0, 1.0]);
        let whole: PhantomToReference = "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1".parse().unwrap();
        assert_eq!(whole.0.column(3).as_slice(), [5.0, 6.0, 7.0, 1.0]);
        for wrong in ["1,2", "", "1,2,x", "nan,0,0", "1,2,3,4"] {
            assert!(wrong.parse::<PhantomToReference>().unwrap_err().contains("mm"), "{wrong}");
        }
    }

    #[test]
    fn a_region_without_pixels_and_a_pixel_in_metres_are_refused() {
        assert_eq!("27,28,766,562".parse::<Region>().unwrap().size, [766, 562]);
        for wrong in ["1,2,0,5", "1,2,3", "-1,0,5,5", "a"] {
            assert!(wrong.parse::<Region>().is_err(), "{wrong}");
        }
        assert_eq!("0.078".parse::<PixelMm>().unwrap(), PixelMm { x: 0.078, y: 0.078 });
        assert_eq!("0.078,0.074".parse::<PixelMm>().unwrap(), PixelMm { x: 0.078, y: 0.074 });
        for wrong in ["0.000078", "-0.1", "78", "0", "nan", "1,1,1"] {
            assert!(wrong.parse::<PixelMm>().unwrap_err().contains("0.078"), "{wrong}");
        }
    }

    #[test]
    fn an_orientation_is_one_of_four() {
        assert_eq!("MN".parse::<Stored>(), Ok(Stored(Orientation::Mn)));
        assert!("XX".parse::<Stored>().unwrap_err().contains("MF"));
        assert!("FM".parse::<Stored>().is_err());
    }
}
