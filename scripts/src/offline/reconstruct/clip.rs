//! The part of a picture that shows tissue: what lies beside it, text and rulers, is no border of a lumen.

use nalgebra::{Isometry3, Translation3};
use probepath_frames::{Image, Pose};
use probepath_us_capture::plus::Rectangle;
use probepath_us_capture::{BScan, PlacedBScan, Setting};

use super::ReconstructError;

/// The image's part within a clip rectangle, in the same place; all of it without one.
///
/// # Errors
/// When no pixel is left.
pub(super) fn clipped(
    image: &PlacedBScan,
    rectangle: Option<&Rectangle>,
) -> Result<PlacedBScan, ReconstructError> {
    let Some(Rectangle { origin, size }) = rectangle else { return Ok(image.clone()) };
    let bscan = &image.bscan;
    let there = (bscan.width(), bscan.height());
    let part = |axis: usize, limit: usize| {
        let from = origin[axis].min(limit);
        from..origin[axis].saturating_add(size[axis]).min(limit)
    };
    let (columns, rows) = (part(0, there.0), part(1, there.1));
    if columns.is_empty() || rows.is_empty() {
        return Err(ReconstructError::Clip { origin: *origin, size: *size, there });
    }
    if (columns.len(), rows.len()) == there {
        return Ok(image.clone());
    }
    let lines = bscan.pixels().chunks_exact(there.0).skip(rows.start).take(rows.len());
    let pixels: Vec<u8> =
        lines.flat_map(|line| line.get(columns.clone()).unwrap_or_default()).copied().collect();
    let spacing = bscan.setting.spacing;
    let (left_m, down_m) = (columns.start as f64 * spacing.x_m, rows.start as f64 * spacing.y_m);
    let setting = Setting {
        window_top_m: bscan.setting.window_top_m + down_m,
        window_height_m: rows.len() as f64 * spacing.y_m,
        window_width_m: columns.len() as f64 * spacing.x_m,
        ..bscan.setting
    };
    // FRAMES: the part's first pixel, seen from the whole picture's, in the same plane with the same axes.
    let image_from_part = Pose::<Image, Image>::assume(Isometry3::from_parts(
        Translation3::new(left_m, down_m, 0.0),
        nalgebra::UnitQuaternion::identity(),
    ));
    let stamps = (bscan.formed, bscan.arrived);
    Ok(PlacedBScan {
        bscan: BScan::new(bscan.number, stamps, setting, (columns.len(), rows.len()), pixels)?,
        world_from_image: image.world_from_image * image_from_part,
        ..image.clone()
    })
}

#[cfg(test)]
mod tests {
    use probepath_frames::{Point, Stamp};
    use probepath_us_capture::PixelSpacing;

    use super::*;

    #[test]
    fn a_pixel_of_the_part_is_where_it_was_in_the_whole() {
        let spacing = PixelSpacing { x_m: 2e-4, y_m: 1e-4 };
        let setting = Setting {
            depth_m: 4e-4,
            focus_m: 2e-4,
            window_top_m: 0.0,
            window_height_m: 4e-4,
            window_width_m: 1e-3,
            spacing,
        };
        let pixels: Vec<u8> = (0..20).collect();
        let bscan = BScan::new(7, (Stamp::ZERO, Stamp::ZERO), setting, (5, 4), pixels).unwrap();
        let turned = Isometry3::rotation(nalgebra::Vector3::new(0.1, -0.4, 0.9));
        // FRAMES: any place will do.
        let image = PlacedBScan {
            bscan,
            world_from_probe: Pose::assume(Isometry3::identity()),
            world_from_image: Pose::assume(turned),
            wrench: None,
        };
        let rectangle = Rectangle { origin: [1, 2], size: [3, 9] };
        let part = clipped(&image, Some(&rectangle)).unwrap();
        assert_eq!((part.bscan.width(), part.bscan.height()), (3, 2));
        assert_eq!(part.bscan.pixels(), [11, 12, 13, 16, 17, 18]);
        let place = |image: &PlacedBScan, u, v| -> Point<_> { image.world_from_image * spacing.point(u, v) };
        assert!(place(&part, 2.0, 1.0).distance(&place(&image, 3.0, 3.0)) < 1e-15);
        assert!((part.bscan.setting.window_top_m - 2e-4).abs() < 1e-15);
        let beside = Rectangle { origin: [5, 0], size: [3, 3] };
        assert!(matches!(clipped(&image, Some(&beside)), Err(ReconstructError::Clip { .. })));
    }
}
