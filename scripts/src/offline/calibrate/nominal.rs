//! Whether the image is the right way round, by what is known of the probe.
//!
//! Images alone cannot tell: a mirrored image of a plane is the same image, seen from behind.

use std::path::Path;

use probepath_frames::{Image, Pose, Probe};
use probepath_us_capture::Calibration;
use probepath_us_capture::plus::PlusConfig;

use super::CalibrateError;

/// How far (degrees) an axis may be from where it is thought to be, or from the opposite of it, to be taken for one of
/// the two.
const SURE_DEG: f64 = 30.0;

/// Where the image is on the probe by an earlier calibration or a PLUS configuration.
///
/// # Errors
/// When the file is neither, or says nothing of it.
pub(super) fn read(path: &Path) -> Result<Pose<Probe, Image>, CalibrateError> {
    if path.extension().is_none_or(|ending| ending != "xml") {
        return Ok(Calibration::read(path)?.probe_from_image);
    }
    let bad = |source| CalibrateError::Plus { path: path.into(), source };
    let config = PlusConfig::read(path).map_err(bad)?;
    let pixels = config.pixels_in_probe(&config.frames.image, &config.frames.probe).map_err(bad)?;
    Ok(pixels.nearest_rigid().0)
}

/// Refuses an image that lies in the probe as a mirrored one would: one of its axes as it is thought to be, the other and
/// the normal the other way.
///
/// # Errors
/// When it does, with the orientation that would be right.
pub(super) fn check(nominal: &Pose<Probe, Image>, found: &Pose<Probe, Image>) -> Result<(), CalibrateError> {
    let turn = nominal.isometry().rotation.inverse() * found.isometry().rotation;
    let axes = turn.to_rotation_matrix();
    let off = |k: usize| axes[(k, k)].clamp(-1.0, 1.0).acos().to_degrees();
    let kept = |k: usize| off(k) < SURE_DEG;
    let reversed = |k: usize| off(k) > 180.0 - SURE_DEG;
    match (0, 1) {
        (x, y) if reversed(x) && kept(y) && reversed(2) => Err(CalibrateError::Mirrored {
            axis: "column",
            angle_deg: off(x),
            hint: "UF instead of MF, or MF instead of UF",
        }),
        (x, y) if kept(x) && reversed(y) && reversed(2) => Err(CalibrateError::Mirrored {
            axis: "row",
            angle_deg: off(y),
            hint: "MN instead of MF, or MF instead of MN",
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Vector3};

    #[test]
    fn a_half_turn_about_an_image_axis_is_a_mirrored_image() {
        // FRAMES: any place of an image on a probe.
        let nominal = Pose::assume(Isometry3::new(Vector3::new(0.1, 0.0, 0.2), Vector3::new(1.0, 0.4, -0.7)));
        // FRAMES: the same image, turned a little more or a half.
        let turned = |turn| nominal * Pose::<Image, Image>::assume(Isometry3::rotation(turn));
        let half = std::f64::consts::PI;
        assert!(check(&nominal, &turned(Vector3::new(0.2, -0.1, 0.2))).is_ok());
        let columns = check(&nominal, &turned(Vector3::y() * (half - 0.1))).unwrap_err().to_string();
        assert!(columns.contains("column") && columns.contains("UF"), "{columns}");
        let rows = check(&nominal, &turned(Vector3::x() * half)).unwrap_err().to_string();
        assert!(rows.contains("row") && rows.contains("MN"), "{rows}");
        // Turned about its normal it is a probe that was mounted the other way, not a mirrored image.
        assert!(check(&nominal, &turned(Vector3::z() * half)).is_ok());
    }
}
