//! What every image shows by itself, without poses: what is left to draw when there is no calibration.

use probepath_us_capture::dots::{Dot, DotFinder, DotSettings};
use probepath_us_capture::label::Labeller;
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::shots::{Shot, Shots};
use probepath_us_capture::spatial::{Reason, Seen, SpatialOptions};

use super::CalibrateError;

/// The dots of every image, and the wires that made them by this image alone.
///
/// # Errors
/// When the mask or the images' size is no use.
pub(super) fn seen(
    shots: &Shots,
    phantom: &WirePhantom,
    options: &SpatialOptions,
) -> Result<Vec<Seen>, CalibrateError> {
    let settings = options.spacing.map_or_else(DotSettings::default, DotSettings::for_spacing);
    let (width, height) = shots.size();
    let mut finder = DotFinder::new(settings, &options.mask, width, height)?;
    let labeller = Labeller::new(phantom, options.label);
    shots.shots().iter().map(|shot| one(shot, &mut finder, &labeller, options)).collect()
}

fn one(
    shot: &Shot,
    finder: &mut DotFinder,
    labeller: &Labeller,
    options: &SpatialOptions,
) -> Result<Seen, CalibrateError> {
    let dots: Vec<Dot> = match &shot.pixels {
        Ok(pixels) => finder.find(pixels)?,
        Err(reason) => {
            let labels = Err(Reason::Image(reason.clone()));
            return Ok(Seen { number: shot.number, dots: Vec::new(), labels });
        }
    };
    // Without a pixel size nothing can be compared with a phantom in millimetres: a nominal one shows at least the dots.
    let spacing = options.spacing.unwrap_or(NOMINAL);
    let labels = labeller.only(&dots, spacing).map_err(Reason::from);
    Ok(Seen { number: shot.number, dots, labels })
}

/// About what most scanners have.
const NOMINAL: probepath_us_capture::PixelSpacing =
    probepath_us_capture::PixelSpacing { x_m: 1e-4, y_m: 1e-4 };
