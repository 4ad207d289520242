//! What PLUS found on its own data (`*.results.xml`): dots, stamps, poses and its calibration.

#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::path::Path;

use nalgebra::{Matrix2, Matrix4};
use probepath_frames::{Phantom, Point, Pose, Probe, Span, Stamp, Track, World};
use probepath_us_capture::PixelMap;
use probepath_us_capture::fit::{SeenWire, Sighting};
use probepath_us_capture::phantom::{Wire, WirePhantom, ZFiducial};
use roxmltree::{Document, Node};

/// One half of a data set: calibration or validation.
pub struct Half {
    pub sightings: Vec<Sighting>,
    pub track: Track<World, Probe>,
}

/// A data set.
pub struct Set {
    pub phantom: WirePhantom,
    pub world_from_phantom: Pose<World, Phantom>,
    pub plus: PixelMap<Probe>,
    pub calibration: Half,
    pub validation: Half,
}

/// The freehand set, fCal 1.2.
pub fn freehand(folder: &Path) -> Set {
    let config = "PlusDeviceSet_fCal_Sim_SpatialCalibration_1.2.xml";
    let place = Matrix4::new(
        0.00898765,
        -0.0136951,
        -0.999866,
        9.59137, //
        0.0246163,
        -0.9996,
        0.0139127,
        36.0012, //
        -0.999657,
        -0.024738,
        -0.00864693,
        87.8909, //
        0.0,
        0.0,
        0.0,
        1.0,
    );
    read(
        folder,
        config,
        "FreehandCalibration3NWires.results.xml",
        &place,
        Some("ReferenceToTrackerTransform"),
    )
}

/// The motorised stepper.
pub fn stepper(folder: &Path) -> Set {
    let config = "PlusDeviceSet_iCal_SonixTouch_BlackTargetGuideStepper_1.1.xml";
    let place = Matrix4::new_translation(&nalgebra::Vector3::new(-29.7239, -79.1055, 0.0));
    read(folder, config, "UsTemplateCalibration_3NWires.results.xml", &place, None)
}

fn read(folder: &Path, config: &str, results: &str, place_mm: &Matrix4<f64>, reference: Option<&str>) -> Set {
    let text = std::fs::read_to_string(folder.join(config)).unwrap();
    let phantom = phantom(&Document::parse(&text).unwrap());
    let text = std::fs::read_to_string(folder.join(results)).unwrap();
    let results = Document::parse(&text).unwrap();
    let transform = results.descendants().find(|n| n.has_tag_name("Transform")).unwrap();
    Set {
        world_from_phantom: pose(place_mm),
        plus: PixelMap::from_matrix_mm(&matrix(transform.attribute("Matrix").unwrap())).unwrap(),
        calibration: half(&results, "CalibrationData", &phantom, reference),
        validation: half(&results, "ValidationData", &phantom, reference),
        phantom,
    }
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|word| word.parse().unwrap()).collect()
}

fn matrix(text: &str) -> Matrix4<f64> {
    Matrix4::from_row_iterator(numbers(text))
}

fn pose<A: probepath_frames::Frame, B: probepath_frames::Frame>(matrix_mm: &Matrix4<f64>) -> Pose<A, B> {
    let mut metres = *matrix_mm;
    metres.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e-3);
    Pose::from_matrix(&metres).unwrap()
}

fn phantom(config: &Document<'_>) -> WirePhantom {
    let (mut wires, mut zs) = (Vec::new(), Vec::new());
    for pattern in config.descendants().filter(|n| n.has_tag_name("Pattern")) {
        let first = wires.len();
        zs.push(ZFiducial { first, diagonal: first + 1, last: first + 2 });
        wires.extend(pattern.children().filter(|n| n.has_tag_name("Wire")).map(|n| wire(&n)));
    }
    WirePhantom { name: "PLUS".into(), wires, zs, landmarks: Vec::new() }
}

fn wire(node: &Node<'_, '_>) -> Wire {
    let end = |name| {
        let at = numbers(node.attribute(name).unwrap());
        Point::new(at[0] * 1e-3, at[1] * 1e-3, at[2] * 1e-3)
    };
    Wire {
        name: node.attribute("Name").unwrap().into(),
        front: end("EndPointFront"),
        back: end("EndPointBack"),
    }
}

fn half(results: &Document<'_>, name: &str, phantom: &WirePhantom, reference: Option<&str>) -> Half {
    let mut half = Half { sightings: Vec::new(), track: Track::new(Span::from_seconds(2.0)) };
    let data = results.descendants().find(|n| n.has_tag_name(name)).unwrap();
    for frame in data.children().filter(|n| n.has_tag_name("Frame")) {
        let field = |name: &str| {
            let found = frame.descendants().find(|n| n.attribute("Name") == Some(name));
            found.and_then(|n| n.attribute("Value")).map(str::to_owned)
        };
        // A frame that PLUS refused has neither stamp nor poses.
        let Some(seconds) = field("Timestamp") else { continue };
        let seconds: f64 = seconds.parse().unwrap();
        let stamp = Stamp::from_nanoseconds((seconds * 1e9).round() as i64);
        half.track.push(stamp, world_from_probe(&field, reference)).unwrap();
        half.sightings.push(Sighting {
            image: frame.attribute("Index").unwrap().parse().unwrap(),
            stamp,
            dots: dots(&frame, phantom),
        });
    }
    half
}

fn world_from_probe(field: &dyn Fn(&str) -> Option<String>, reference: Option<&str>) -> Pose<World, Probe> {
    let Some(reference) = reference else {
        return pose(&matrix(&field("ProbeToStepperHomeTransform").unwrap()));
    };
    let tracker_from_world: Pose<probepath_frames::Base, World> = pose(&matrix(&field(reference).unwrap()));
    tracker_from_world.inverse() * pose(&matrix(&field("ProbeToTrackerTransform").unwrap()))
}

/// The labelled dots; PLUS says nothing of their uncertainty: half a pixel.
fn dots(frame: &Node<'_, '_>, phantom: &WirePhantom) -> Vec<SeenWire> {
    let points = frame.children().find(|n| n.has_tag_name("SegmentedPoints"));
    let points = points.into_iter().flat_map(|n| n.children()).filter(|n| n.has_tag_name("Point"));
    points
        .map(|point| {
            let name = point.attribute("WireName").unwrap();
            let at = numbers(point.attribute("Position").unwrap());
            SeenWire {
                wire: phantom.wires.iter().position(|w| w.name == name).unwrap(),
                at_px: [at[0], at[1]],
                covariance_px2: Matrix2::identity() * 0.25,
            }
        })
        .collect()
}
