//! What is said between `reconstruct` and a program that finds lumens: one JSON document a line, and grey levels.

use std::collections::{BTreeMap, BTreeSet};

use probepath_recon::{Contour, ImageLumen, NoLumen};
use probepath_us_capture::PlacedBScan;
use serde::Deserialize;
use serde_json::json;

/// Version of the protocol.
const VERSION: u32 = 1;
/// How sure a contour is when its finder does not say (mm).
const USUAL_SD_MM: f64 = 0.15;

/// The first line.
pub(super) fn hello(dynamic_range_db: f64) -> String {
    format!("{}\n", json!({ "probepath_lumen": VERSION, "dynamic_range_db": dynamic_range_db }))
}

/// The line before an image's grey levels.
pub(super) fn question(image: &PlacedBScan) -> String {
    let (bscan, setting) = (&image.bscan, &image.bscan.setting);
    let mut place = image.world_from_image.isometry().to_homogeneous();
    place.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e3);
    let question = json!({
        "number": bscan.number,
        "columns": bscan.width(),
        "rows": bscan.height(),
        "pixel_mm": [setting.spacing.x_m * 1e3, setting.spacing.y_m * 1e3],
        "depth_mm": setting.depth_m * 1e3,
        "focus_mm": setting.focus_m * 1e3,
        "window_top_mm": setting.window_top_m * 1e3,
        // Row by row.
        "world_from_image_mm": place.transpose().as_slice(),
        "bytes": bscan.pixels().len(),
    });
    format!("{question}\n")
}

/// The answer to one image.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Answer {
    number: u64,
    #[serde(default)]
    contours: Vec<Drawn>,
    /// Why there is no lumen.
    #[serde(default)]
    none: Option<String>,
}

/// A contour as a program draws it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Drawn {
    /// Columns and rows of a closed line.
    pixels: Vec<(f64, f64)>,
    /// Standard deviation of every point (mm).
    #[serde(default)]
    sd_mm: Option<f64>,
    /// Or of each by itself (mm).
    #[serde(default)]
    points_sd_mm: Option<Vec<f64>>,
    /// Of what neighbouring images share (mm).
    #[serde(default)]
    common_sd_mm: f64,
    /// 0 is the one followed first.
    #[serde(default)]
    vessel: usize,
}

impl Answer {
    /// The answer of a line.
    ///
    /// # Errors
    /// Says what is wrong with it.
    pub(super) fn of(line: &[u8], number: u64) -> Result<Self, String> {
        let answer: Self = serde_json::from_slice(line).map_err(|error| error.to_string())?;
        if answer.number != number {
            return Err(format!("it is for image {}", answer.number));
        }
        match (&answer.none, answer.contours.is_empty()) {
            (None, true) => return Err("it has neither `contours` nor `none`".into()),
            (Some(_), false) => return Err("it has both `contours` and `none`".into()),
            _ => {}
        }
        let vessels: BTreeSet<usize> = answer.contours.iter().map(|drawn| drawn.vessel).collect();
        if vessels.len() < answer.contours.len() {
            return Err("two contours are of the same vessel".into());
        }
        Ok(answer)
    }

    /// What the image gave; reasons of its own are counted.
    pub(super) fn of_image(self, image: &PlacedBScan, declined: &mut BTreeMap<String, usize>) -> ImageLumen {
        let mut lumen = Err(NoLumen::Declined);
        let mut others = Vec::new();
        if let Some(why) = self.none {
            *declined.entry(why).or_default() += 1;
        }
        for drawn in self.contours {
            match (drawn.vessel, drawn.contour(image)) {
                (0, contour) => lumen = contour,
                (_, Ok(contour)) => others.push(contour),
                // A branch that is none is left out; the vessel that is followed is not judged by it.
                (_, Err(_)) => {}
            }
        }
        others.sort_by_key(|contour: &Contour| contour.vessel);
        ImageLumen { number: image.bscan.number, lumen, others }
    }
}

impl Drawn {
    fn contour(self, image: &PlacedBScan) -> Result<Contour, NoLumen> {
        let each = self.sd_mm.unwrap_or(USUAL_SD_MM);
        let sd_mm = self.points_sd_mm.unwrap_or_else(|| vec![each; self.pixels.len()]);
        let contour = Contour::new(image, self.pixels, sd_mm, self.common_sd_mm)?;
        Ok(Contour { vessel: self.vessel, ..contour })
    }
}
