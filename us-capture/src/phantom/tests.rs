//! Phantoms that are read, and those that are refused.

use probepath_frames::Point;

use super::*;

/// One Z in the plane z = 0: sides at x = 0 and 30 mm.
fn one_z() -> (Vec<Wire>, Vec<ZFiducial>) {
    let wire = |name: &str, front: f64, back: f64| Wire {
        name: name.into(),
        front: Point::new(front / 1e3, 0.0, 0.0),
        back: Point::new(back / 1e3, 0.04, 0.0),
    };
    let wires = vec![wire("left", 0.0, 0.0), wire("across", 5.0, 25.0), wire("right", 30.0, 30.0)];
    (wires, vec![ZFiducial { first: 0, diagonal: 1, last: 2 }])
}

fn refused(change: impl FnOnce(&mut Vec<Wire>, &mut Vec<ZFiducial>)) -> String {
    let (mut wires, mut zs) = one_z();
    change(&mut wires, &mut zs);
    WirePhantom::new("test", wires, zs, vec![]).expect_err("refused").to_string()
}

#[test]
fn every_phantom_that_ships_is_one_of_its_name() {
    for name in WirePhantom::shipped_names() {
        let text = shipped::text(name).expect("a text");
        let phantom = WirePhantom::from_toml(text).expect(name);
        assert_eq!(phantom.name, name);
        assert_eq!(WirePhantom::shipped(name), Some(phantom.clone()));
        assert_eq!(WirePhantom::from_toml(&phantom.to_toml().expect("a text")).expect(name), phantom);
    }
    assert_eq!(WirePhantom::shipped("fcal-9"), None);
}

#[test]
fn the_papers_phantom_is_19_zs_of_24_holes_in_five_rows() {
    let phantom = WirePhantom::shipped("z-19").expect("it ships");
    assert_eq!((phantom.wires.len(), phantom.zs.len(), phantom.landmarks.len()), (24 + 19, 19, 4));
    let mut widths_mm = Vec::new();
    for z in &phantom.zs {
        let [first, diagonal, last] = phantom.wires_of(*z).expect("its wires");
        // It is woven: the diagonal joins a hole of one side to the other side's hole in the other plate.
        let joins = |a: &Wire, b: &Wire| {
            diagonal.front.distance(&a.front) < 1e-9 && diagonal.back.distance(&b.back) < 1e-9
        };
        assert!(joins(first, last) || joins(last, first), "{}", diagonal.name);
        widths_mm.push(first.front.distance(&last.front) * 1e3);
    }
    widths_mm.sort_by(f64::total_cmp);
    assert!((widths_mm[0] - 11.0).abs() < 1e-9 && (widths_mm[18] - 20.0).abs() < 1e-9);
    assert!(widths_mm.windows(2).all(|w| w[1] - w[0] > 0.49), "every Z has a width of its own");
    for wire in &phantom.wires {
        assert!((wire.run().y - 0.06).abs() < 1e-12, "the plates are 60 mm apart");
        for end in [wire.front.vector(), wire.back.vector()] {
            assert!(
                (0.005..=0.105).contains(&end.x) && (0.005..=0.085).contains(&end.z),
                "inside the plates"
            );
        }
    }
}

#[test]
fn wherever_a_probe_looks_into_the_papers_phantom_it_sees_six_dots() {
    let phantom = WirePhantom::shipped("z-19").expect("it ships");
    // An image 40 mm wide and 50 mm deep, its face at the plates' upper edge, its middle over the wires' middle 50 mm,
    // square to the wires or turned by 20 degrees.
    let mut fewest = usize::MAX;
    for (middle_mm, y_mm, turn_deg) in (0..51).flat_map(|i| {
        (1..12)
            .flat_map(move |j| [-20.0, 0.0, 20.0].map(|turn| (30.0 + f64::from(i), f64::from(j) * 5.0, turn)))
    }) {
        let tan = f64::to_radians(turn_deg).tan();
        let seen = phantom.wires.iter().filter(|wire| {
            // The plane is y = y_mm + tan (x - middle): where the wire meets it, as a part of its run.
            let (front, run) = (wire.front.vector() * 1e3, wire.run() * 1e3);
            let part = (y_mm + tan * (front.x - middle_mm) - front.y) / (run.y - tan * run.x);
            let at = front + run * part;
            let across = (at.x - middle_mm) / f64::to_radians(turn_deg).cos();
            (0.0..=1.0).contains(&part) && across.abs() < 20.0 && (40.0..90.0).contains(&at.z)
        });
        fewest = fewest.min(seen.count());
    }
    assert!(fewest >= 6, "{fewest}");
}

#[test]
fn a_phantom_that_cannot_be_says_which_part_and_why() {
    let said = refused(|wires, _| wires[1].back = wires[1].front);
    assert!(said.starts_with("wire 2 (\"across\"): it is 0 mm long"), "{said}");
    let said = refused(|wires, _| wires[2].front = Point::new(f64::NAN, 0.0, 0.0));
    assert_eq!(said, "wire 3 (\"right\"): a coordinate is not finite");
    let said = refused(|wires, _| wires[0].back = Point::new(0.0, 40.0, 0.0));
    assert!(said.contains("40000 mm") && said.contains("are these millimetres?"), "{said}");
    let said = refused(|wires, _| wires[2].name = "left".into());
    assert_eq!(said, "wire 3 (\"left\"): the one at number 1 has the same name; give each its own");
    let said = refused(|wires, _| wires[2].name = " ".into());
    assert!(said.ends_with("its name is empty"), "{said}");
    let said = refused(|wires, _| wires.truncate(2));
    assert!(said.starts_with("the phantom: it has 2 wires"), "{said}");
    let said = refused(|wires, _| {
        let again = Wire { name: "again".into(), front: wires[0].back, back: wires[0].front };
        wires.push(again);
    });
    assert_eq!(said, "wire 4 (\"again\"): wire \"left\" is in the same place");
}

#[test]
fn a_z_that_cannot_be_says_why() {
    let said = refused(|_, zs| zs[0].last = 3);
    assert_eq!(said, "Z 1: there is no wire of index 3; there are 3");
    let said = refused(|_, zs| zs[0].last = 0);
    assert!(said.starts_with("Z 1: it names one wire twice"), "{said}");
    let said = refused(|wires, _| wires[1].back = Point::new(0.025, 0.04, 0.002));
    assert!(said.starts_with("Z 1: its wires are not in one plane: 2.00 mm off"), "{said}");
    let said = refused(|wires, _| wires[2].back = Point::new(0.032, 0.04, 0.0));
    assert!(said.starts_with("Z 1: its sides are 2.86 degrees from parallel"), "{said}");
    let said = refused(|wires, _| wires[1].back = Point::new(0.005, 0.04, 0.0));
    assert!(said.starts_with("Z 1: its diagonal \"across\" crosses neither side"), "{said}");
    let said = refused(|_, zs| zs[0] = ZFiducial { first: 1, diagonal: 0, last: 2 });
    assert!(said.starts_with("Z 1: its sides are 26.57 degrees from parallel"), "{said}");
    let said = refused(|wires, _| wires[1].back = Point::new(0.045, 0.04, 0.0));
    assert!(said.starts_with("Z 1: its diagonal \"across\" lies 15.00 mm outside of its sides"), "{said}");
}

const TEXT: &str = r#"name = "one Z"

[[wire]]
name = "left"
front_mm = [0, 0, 0]
back_mm = [0, 40, 0]

[[wire]]
name = "across"
front_mm = [5, 0, 0]
back_mm = [25, 40, 0]

[[wire]]
name = "right"
front_mm = [30, 0, 0]
back_mm = [30, 40, 0]

[[z]]
wires = ["left", "across", "right"]

[[landmark]]
name = "corner"
at_mm = [-10, 0, 0]
"#;

#[test]
fn a_toml_error_has_its_line() {
    let (wires, zs) = one_z();
    let phantom = WirePhantom::from_toml(TEXT).expect("a phantom");
    assert_eq!((&phantom.wires, &phantom.zs), (&wires, &zs));
    let said = |from: &str, to: &str| {
        let changed = TEXT.replacen(from, to, 1);
        assert_ne!(changed, TEXT);
        WirePhantom::from_toml(&changed).expect_err("refused").to_string()
    };
    for (from, to, line, word) in [
        ("front_mm = [5", "front = [5", "line 10, column 1", "unknown field `front`, expected one of"),
        ("front_mm = [5", "front_cm = [5", "line 10, column 1", "unknown field `front_cm`"),
        ("back_mm = [25, 40, 0]", "", "line 8", "missing field `back_mm`"),
        ("[5, 0, 0]", "[5, 0]", "line 10, column 12", "3"),
        ("[5, 0, 0]", "\"5 0 0\"", "line 10, column 12", "array"),
        ("name = \"one Z\"", "", "line 1, column 1", "missing field `name`"),
        ("name = \"one Z\"", "name = \"one Z\"\nunit = \"m\"", "line 2, column 1", "unknown field `unit`"),
        ("[25, 40, 0]", "[5, 0, 0]", "line 8", "wire 2 (\"across\"): it is 0 mm long"),
        ("[25, 40, 0]", "[inf, 0, 0]", "line 8", "not finite"),
        ("[25, 40, 0]", "[25, 40, 9]", "line 18", "Z 1: its wires are not in one plane"),
        ("\"right\"]", "\"rihgt\"]", "line 18", "Z 1: there is no wire \"rihgt\""),
        ("[-10, 0, 0]", "[nan, 0, 0]", "line 21", "landmark 1 (\"corner\"): a coordinate is not finite"),
    ] {
        let said = said(from, to);
        assert!(said.contains(line) && said.contains(word), "{from} -> {to}: {said}");
    }
}

#[test]
fn a_file_is_known_by_what_is_in_it() {
    let folder = std::env::temp_dir().join(format!("probepath-phantom-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let read = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, bytes).expect("written");
        WirePhantom::read(&path)
    };
    assert!(read("a.xml", TEXT.as_bytes()).is_ok(), "TOML, whatever its name");
    let xml = "\u{feff}<PhantomDefinition><Geometry/></PhantomDefinition>";
    let said = read("a.toml", xml.as_bytes()).expect_err("no wires").to_string();
    assert!(said.contains("line 1: the phantom: it has 0 wires"), "{said}");
    let said = read("b.xml", b"<a/>").expect_err("no phantom").to_string();
    assert_eq!(said, "no PhantomDefinition under <a>: this file holds no phantom");
    assert!(matches!(read("c", b"\xff\xfe"), Err(BadPhantom::Disk { .. })));
    assert!(matches!(WirePhantom::read(&folder.join("none")), Err(BadPhantom::Disk { .. })));
    std::fs::remove_dir_all(&folder).expect("removed");
}
