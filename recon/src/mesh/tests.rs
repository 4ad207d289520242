use super::*;
use crate::phantom_images::Dice;

/// A closed tube in the World: up is -y, so its volume is positive only when nothing is mirrored.
fn tube() -> LumenSurface {
    let (along, around) = (30, 12);
    let line: Vec<Vector3<f64>> = (0..along).map(|i| Vector3::new(0.001, 0.03, -0.002 * i as f64)).collect();
    let points = line.iter().flat_map(|c| {
        (0..around).map(move |k| {
            let angle = std::f64::consts::TAU * k as f64 / around as f64;
            // Along -z with up = -y, side = tangent x up = -z x -y = -x.
            probepath_frames::Point::new(c.x - 0.004 * angle.sin(), c.y - 0.004 * angle.cos(), c.z)
        })
    });
    LumenSurface {
        along,
        around,
        points: points.collect(),
        at_m: (0..along).map(|i| 0.002 * i as f64).collect(),
        centres: Vec::new(),
        measured: vec![true; along],
    }
}

#[test]
fn the_mesh_is_closed_and_faces_outward() {
    let mesh = tube().mesh();
    let mut edges = std::collections::HashMap::new();
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            assert!(edges.insert((*from, *to), ()).is_none(), "an edge is used twice in one direction");
        }
    }
    assert!(edges.keys().all(|(a, b)| edges.contains_key(&(*b, *a))), "an edge has one side only");
    let polygon = 12.0 / 2.0 * 0.004_f64.powi(2) * (std::f64::consts::TAU / 12.0).sin();
    assert!((mesh.volume_m3() / (polygon * 0.058) - 1.0).abs() < 1e-9, "{}", mesh.volume_m3());
}

#[test]
fn every_format_gives_back_what_was_written() {
    let folder = std::env::temp_dir().join(format!("probepath-mesh-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the test");
    let mut mesh = tube().mesh();
    let count = mesh.points.len();
    mesh = mesh.with_scalars("area_mm2", (0..count).map(|i| i as f64 / 7.0).collect());
    mesh = mesh.with_scalars("error_sd_mm", (0..count).map(|i| 0.1 + (i as f64).sin()).collect());
    mesh.colours = (0..count).map(|i| [i as u8, 255 - i as u8, 7]).collect();
    for name in ["a.stl", "a.ply", "a.VTP"] {
        let path = folder.join(name);
        mesh.write(&path).expect("written");
        let bytes = std::fs::read(&path).expect("there");
        assert!(String::from_utf8_lossy(&bytes[..400]).contains("SPACE"), "{name}");
        let back = Mesh::read(&path).expect("read");
        assert_eq!((back.points.len(), back.triangles.len()), (mesh.points.len(), mesh.triangles.len()));
        assert!((back.volume_m3() / mesh.volume_m3() - 1.0).abs() < 1e-5, "{name}");
        for (a, b) in mesh.triangles.iter().zip(&back.triangles) {
            for (p, q) in mesh.corners(a).iter().zip(back.corners(b)) {
                assert!((p - q).norm() < 1e-8, "{name}: {p} {q}");
            }
        }
        if name != "a.stl" {
            assert_eq!(back.scalars, mesh.scalars, "{name}");
        }
        if name == "a.ply" {
            assert_eq!(back.colours, mesh.colours);
        }
    }
    std::fs::remove_dir_all(&folder).expect("removed");
}

#[test]
fn a_number_that_is_missing_stays_missing_in_every_file_that_keeps_numbers() {
    let mesh = tube().mesh().with_scalars("area_mm2", vec![1.5]);
    for (bytes, read) in [(ply::bytes(&mesh), ply::read as Reader), (vtp::bytes(&mesh), vtp::read)] {
        let back = read(&bytes).expect("read");
        let values = back.scalars("area_mm2").expect("there");
        assert!(values.len() == mesh.points.len() && values[1..].iter().all(|value| value.is_nan()));
        assert!((values[0] - 1.5).abs() < 1e-12);
    }
}

#[test]
fn a_file_cut_anywhere_or_damaged_is_refused_or_whole_and_never_panics() {
    let mesh = tube().mesh();
    let readers: [(Vec<u8>, Reader); 3] =
        [(stl::bytes(&mesh), stl::read), (ply::bytes(&mesh), ply::read), (vtp::bytes(&mesh), vtp::read)];
    let mut dice = Dice(9);
    for (bytes, read) in readers {
        for _ in 0..150 {
            let cut = (dice.uniform() * bytes.len() as f64 * 0.97) as usize;
            let read_back = read(&bytes[..cut]).and_then(Mesh::checked);
            assert!(read_back.is_err(), "{cut} of {} bytes pass for a surface", bytes.len());
        }
        for _ in 0..300 {
            let mut bytes = bytes.clone();
            for _ in 0..3 {
                let at = (dice.uniform() * bytes.len() as f64) as usize;
                bytes[at] = (dice.uniform() * 256.0) as u8;
            }
            let _ = read(&bytes).and_then(Mesh::checked);
        }
    }
}

#[test]
fn axes_that_are_not_ours_are_refused() {
    let folder = std::env::temp_dir().join(format!("probepath-ras-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the test");
    let path = folder.join("a.ply");
    let mut bytes = ply::bytes(&tube().mesh());
    let says = bytes.windows(9).position(|word| word == b"SPACE=LPS").expect("its axes");
    bytes[says + 6..says + 9].copy_from_slice(b"RAS");
    std::fs::write(&path, bytes).expect("written");
    assert!(matches!(Mesh::read(&path), Err(MeshError::Space { .. })));
    assert!(matches!(Mesh::read(&folder.join("a.obj")), Err(MeshError::Kind { .. })));
    assert!(matches!(Mesh::read(&folder.join("none.stl")), Err(MeshError::File { .. })));
    std::fs::remove_dir_all(&folder).expect("removed");
}
