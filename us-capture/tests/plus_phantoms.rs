//! The phantoms of PLUS: those of `../shared/data/plus` as they are, and what other files may hold.

use std::path::PathBuf;

use nalgebra::Vector3;
use probepath_us_capture::phantom::{BadPhantom, WirePhantom};
use probepath_us_capture::plus::{PlusConfig, PlusError, PlusFrames, Rectangle};

/// The folder with the real files; `None`, said aloud, where it is absent.
fn plus() -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/plus"));
    if !folder.is_dir() {
        #[allow(clippy::print_stderr, reason = "a skipped test is seen")]
        {
            eprintln!("skipped: no folder ../shared/data/plus");
        }
        return None;
    }
    Some(folder)
}

const FCAL_1_2: &str = "PlusDeviceSet_fCal_Sim_SpatialCalibration_1.2.xml";
const ICAL: &str = "PlusDeviceSet_iCal_SonixTouch_BlackTargetGuideStepper_1.1.xml";
const OLD: &str = "PlusDeviceSet_NwirePhantomFreehand_vtkVolumeReconstructorTest2.xml";

#[test]
fn every_xml_of_plus_is_read() {
    let Some(folder) = plus() else { return };
    // File, transforms, wires, Zs, landmarks.
    let expected = [
        ("FreehandCalibration3NWires.results.xml", None),
        ("NwirePhantomFreehand_phantom.xml", Some((6, 2, 0))),
        (OLD, Some((6, 2, 8))),
        (FCAL_1_2, Some((9, 3, 8))),
        (ICAL, Some((9, 3, 1))),
        ("PlusDeviceSet_VolumeReconstructionOnly_SonixRP_TRUS_D70mm_LN_MEAN.xml", None),
        ("PlusDeviceSet_VolumeReconstructionOnly_SonixRP_TRUS_D70mm_NN_LATE.xml", None),
        ("UsTemplateCalibration_3NWires.results.xml", None),
    ];
    for (name, counts) in expected {
        let config = PlusConfig::read(&folder.join(name)).expect(name);
        let found = config.phantom.as_ref().map(|p| (p.wires.len(), p.zs.len(), p.landmarks.len()));
        assert_eq!(found, counts, "{name}");
        let alone = WirePhantom::read(&folder.join(name));
        match config.phantom {
            Some(phantom) => assert_eq!(alone.expect(name), phantom),
            None => assert!(matches!(alone, Err(BadPhantom::Plus(_))), "{name}"),
        }
    }
    // The water tank's result is a lag, with no place in it.
    let lag = PlusConfig::read(&folder.join("TemporalCalibrationResultsBaseline.xml"));
    assert!(matches!(lag, Err(PlusError::NothingHere { .. })));
}

#[test]
fn the_phantoms_that_ship_are_those_of_plus() {
    let Some(folder) = plus() else { return };
    for (file, name) in [(OLD, "fcal-1.0"), (FCAL_1_2, "fcal-1.2"), (ICAL, "ical-3n")] {
        let theirs = WirePhantom::read(&folder.join(file)).expect(file);
        let ours = WirePhantom::shipped(name).expect(name);
        assert_eq!((&ours.wires, &ours.zs), (&theirs.wires, &theirs.zs), "{name}");
        if name != "ical-3n" {
            assert_eq!(ours.landmarks, theirs.landmarks, "{name}");
        }
    }
}

#[test]
fn a_configuration_says_where_the_phantom_stands_and_what_the_images_are() {
    let Some(folder) = plus() else { return };
    let read = |name: &str| PlusConfig::read(&folder.join(name)).expect(name);
    let fcal = read(FCAL_1_2);
    let segmentation = fcal.segmentation.as_ref().expect("segmentation");
    assert_eq!(segmentation.approximate_spacing_mm, Some(0.078));
    assert_eq!(segmentation.clip, Some(Rectangle { origin: [27, 27], size: [766, 562] }));
    assert_eq!(fcal.frames, PlusFrames::default());
    assert_eq!(fcal.phantom.as_ref().map(|p| p.name.as_str()), Some("fCAL 1.2"));
    let placed = fcal.world_from_phantom().expect("rigid").expect("a place");
    let off = placed.origin().vector() - Vector3::new(9.59137, 36.0012, 87.8909) / 1e3;
    assert!(off.norm() < 1e-12);
    let x = placed.x_axis().vector() - Vector3::new(0.00898765, 0.0246163, -0.999657);
    assert!(x.norm() < 1e-5, "{x}");

    let ical = read(ICAL);
    assert_eq!(ical.frames.reference, "StepperHome");
    assert_eq!(ical.world_from_phantom().expect("rigid"), None);

    // The old file's transform is a placeholder; its registration is printed to four digits.
    for name in [OLD, "NwirePhantomFreehand_phantom.xml"] {
        let placed = read(name).world_from_phantom().expect("rigid").expect("a place");
        let off = placed.origin().vector() - Vector3::new(-35.8004, -124.7711, -17.2) / 1e3;
        assert!(off.norm() < 1e-12, "{name}");
        assert!((placed.y_axis().vector() - Vector3::new(0.0038, 0.0057, -1.0)).norm() < 2e-4, "{name}");
    }
    let old = read(OLD).registration.expect("a registration");
    assert_eq!((old.from.as_str(), old.to.as_str(), old.error_mm), ("Phantom", "PhantomReference", None));
}

/// Three wires of an N, as attributes.
const N: [(&str, &str); 3] = [("0 0 0", "0 40 0"), ("5 0 0", "25 40 0"), ("30 0 0", "30 40 0")];

fn wires(wires: &[(&str, &str)]) -> String {
    wires.iter().map(|(f, b)| format!("<Wire EndPointFront=\"{f}\" EndPointBack=\"{b}\"/>\n")).collect()
}

fn xml(inside: &str) -> String {
    format!("<PhantomDefinition><Geometry>\n{inside}</Geometry></PhantomDefinition>")
}

#[test]
fn every_layout_of_patterns_is_read() {
    for (open, close, zs) in [
        ("<NWire>", "</NWire>", 1),
        ("<Pattern Type=\"NWire\">", "</Pattern>", 1),
        ("<Pattern Type=\"nwire\">", "</Pattern>", 1),
        ("<Pattern Type=\"CoplanarParallelWires\">", "</Pattern>", 0),
        ("<Pattern Type=\"CIRS\">", "</Pattern>", 0),
        ("<Pattern>", "</Pattern>", 0),
        ("", "", 0),
    ] {
        let phantom = WirePhantom::from_plus_xml(&xml(&format!("{open}{}{close}", wires(&N)))).expect(open);
        assert_eq!((phantom.wires.len(), phantom.zs.len()), (3, zs), "{open}");
        let names: Vec<&str> = phantom.wires.iter().map(|w| w.name.as_str()).collect();
        assert_eq!(names, ["1", "2", "3"]);
    }
}

#[test]
fn a_side_that_two_patterns_list_is_one_wire() {
    let next = [N[2], ("55 0 0", "35 40 0"), ("60 0 0", "60 40 0")];
    let text = xml(&format!("<NWire>{}</NWire><NWire>{}</NWire>", wires(&N), wires(&next)));
    let phantom = WirePhantom::from_plus_xml(&text).expect("side by side");
    assert_eq!((phantom.wires.len(), phantom.zs.len()), (5, 2));
    assert_eq!(phantom.zs[0].last, phantom.zs[1].first);
}

#[test]
fn names_that_are_there_twice_get_a_number() {
    let named = wires(&N).replace("<Wire ", "<Wire Name=\"?\" ");
    let marks =
        "<Landmarks><Landmark Name=\"?\" Position=\"0 0 0\"/><Landmark Position=\"9 0 0\"/></Landmarks>";
    let phantom = WirePhantom::from_plus_xml(&xml(&(named + marks))).expect("a phantom");
    let names: Vec<&str> = phantom.wires.iter().map(|w| w.name.as_str()).collect();
    assert_eq!(names, ["?", "? (2)", "? (3)"]);
    assert_eq!(phantom.landmarks[1].name, "2");
}

#[test]
fn a_definition_that_is_none_says_the_line_and_what_is_wrong() {
    let refused = |text: &str| WirePhantom::from_plus_xml(text).expect_err("refused").to_string();
    let three = wires(&N);
    let n = |wires: &str| xml(&format!("<Pattern Type=\"NWire\">{wires}</Pattern>"));
    for (text, said) in [
        (
            n(&wires(&N[..2])),
            "line 2: Type=\"NWire\": an NWire has three wires (side, diagonal, side), this one 2",
        ),
        (n(&three.replace("0 40 0", "0 0 0")), "line 2: wire 1 (\"1\"): it is 0 mm long"),
        (n(&three.replace("5 0 0", "5 0 nan")), "line 3: EndPointFront=\"5 0 nan\": a number is not finite"),
        (n(&three.replace("5 0 0", "5 0")), "line 3: EndPointFront=\"5 0\": 3 numbers were expected, 2 came"),
        (n(&three.replace("5 0 0", "5,0,0")), "line 3: EndPointFront=\"5,0,0\""),
        (n(&three.replace("EndPointBack=\"25 40 0\"", "")), "line 3: <Wire> has no EndPointBack"),
        (n(&three.replace("25 40 0", "25 40 7")), "line 2: Z 1: its wires are not in one plane"),
        (n(&three.replace("5 0 0", "5 0 9000")), "line 3: wire 2 (\"2\"): a coordinate is 9000 mm"),
        ("<PhantomDefinition/>".into(), "line 1: there is no <Geometry> in it"),
        ("<PlusConfiguration/>".into(), "no PhantomDefinition under <PlusConfiguration>"),
        ("<PhantomDefinition>".into(), "not XML"),
    ] {
        let found = refused(&text);
        assert!(found.contains(said), "{text}\n{found}");
    }
}

#[test]
fn a_place_that_is_not_rigid_is_refused() {
    for (matrix, good) in [
        ("1 0 0 1  0 1 0 2  0 0 1 3  0 0 0 1", true),
        ("2 0 0 1  0 1 0 2  0 0 1 3  0 0 0 1", false),
        ("-1 0 0 1  0 1 0 2  0 0 1 3  0 0 0 1", false),
        ("1 0.1 0 1  0 1 0 2  0 0 1 3  0 0 0 1", false),
    ] {
        let text = format!(
            "<P><CoordinateDefinitions><Transform From=\"Phantom\" To=\"Reference\" Matrix=\"{matrix}\"/>\
             </CoordinateDefinitions></P>"
        );
        let placed = PlusConfig::parse(&text).expect("a configuration").world_from_phantom();
        assert_eq!(placed.is_ok(), good, "{matrix}");
    }
}

#[test]
fn a_clip_rectangle_of_negative_numbers_is_the_whole_image() {
    let phantom = xml(&wires(&N));
    let text = format!(
        "<P>{phantom}<Segmentation ApproximateSpacingMmPerPixel=\"0.1\" ClipRectangleOrigin=\"-1 -1\" \
         ClipRectangleSize=\"-1 -1\"/></P>"
    );
    let segmentation = PlusConfig::parse(&text).expect("a configuration").segmentation.expect("segmentation");
    assert_eq!((segmentation.approximate_spacing_mm, segmentation.clip), (Some(0.1), None));
    let bad = text.replace("\"0.1\"", "\"-0.1\"");
    assert!(PlusConfig::parse(&bad).expect_err("refused").to_string().contains("positive size"));
}
