//! Files that are none, cannot be read or cannot be written: `reconstruct`, `compare` and `convert` name the file, say what
//! is wrong with it, and end with 1.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use probepath_recon::Mesh;

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("probepath-bad-files-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn probepath(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_probepath")).args(arguments).output().unwrap()
}

/// What is said of a command that cannot be done, in words and as the one document.
fn refused(arguments: &[&str]) -> String {
    let out = probepath(&[arguments, &["--json"]].concat());
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(1), "{arguments:?}: {text}");
    assert!(!text.contains("panicked"), "{arguments:?}: {text}");
    let document: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    let said = document["error"].as_str().unwrap_or_else(|| panic!("{arguments:?}: {document}"));
    said.to_owned()
}

/// A tetrahedron.
fn mesh() -> Mesh {
    let points = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    Mesh { points: points.map(nalgebra::Vector3::from).to_vec(), triangles, ..Mesh::default() }
}

/// A whole file of each kind that is read.
fn whole(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for name in ["whole.stl", "whole.ply", "whole.vtp"] {
        mesh().write(&folder.join(name)).unwrap();
        all.push(folder.join(name));
    }
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 8 8 2\nElementType = MET_UCHAR\nKinds = domain domain list\n\
                  UltrasoundImageOrientation = MF\nElementDataFile = LOCAL\n";
    let sequence = folder.join("whole.igs.mha");
    fs::write(&sequence, [header.as_bytes(), &[7; 128]].concat()).unwrap();
    let again = folder.join("whole.igs.nrrd");
    let made = probepath(&["convert", sequence.to_str().unwrap(), again.to_str().unwrap()]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    all.extend([sequence, again]);
    all
}

/// Name and ending, which for a sequence has two dots.
fn ending(path: &Path) -> String {
    path.file_name().unwrap().to_str().unwrap().split_once('.').unwrap().1.to_owned()
}

/// The commands that read such a file.
fn commands<'c>(file: &'c str, good: &'c str, out: &'c str) -> Vec<Vec<&'c str>> {
    match ending(Path::new(file)).as_str() {
        "stl" | "ply" | "vtp" => vec![
            vec!["compare", good, "--gold", file],
            vec!["compare", file, "--gold", good],
            vec!["convert", file, "made.ply"],
        ],
        "mcap" => {
            vec![vec!["reconstruct", file, "--out", out], vec!["convert", file, "made.dcm"]]
        }
        _ => vec![
            vec!["reconstruct", file, "--calibration", "none.toml", "--out", out],
            vec!["convert", file, "made.igs.mha"],
        ],
    }
}

#[test]
fn a_file_that_is_empty_cut_a_folder_or_not_there_is_named() {
    let folder = folder("none");
    let (good, out) = (folder.join("whole.stl"), folder.join("out"));
    let mut endings: Vec<String> = Vec::new();
    for path in whole(&folder) {
        let bytes = fs::read(&path).unwrap();
        let ending = ending(&path);
        // Somewhere in the middle, and the last bytes (a line break at the end is nothing that is missed).
        for (nth, length) in [bytes.len() / 3, bytes.len() * 2 / 3, bytes.len() - 4].into_iter().enumerate() {
            fs::write(folder.join(format!("cut{nth}.{ending}")), &bytes[..length]).unwrap();
        }
        endings.push(ending);
    }
    endings.push("mcap".into());
    fs::write(folder.join("cut0.mcap"), b"\x89MCAP0\r\n\x01").unwrap();
    for ending in endings {
        fs::write(folder.join(format!("empty.{ending}")), "").unwrap();
        fs::write(folder.join(format!("words.{ending}")), "these are words, and no file of any kind\n")
            .unwrap();
        fs::create_dir(folder.join(format!("folder.{ending}"))).unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink("/dev/null", folder.join(format!("null.{ending}"))).unwrap();
        for name in ["empty", "words", "folder", "null", "missing", "cut0", "cut1", "cut2"] {
            let path = folder.join(format!("{name}.{ending}"));
            if !path.exists() && name != "missing" {
                continue;
            }
            let file = path.to_str().unwrap();
            for command in commands(file, good.to_str().unwrap(), out.to_str().unwrap()) {
                let said = refused(&command);
                assert!(said.contains(&format!("{name}.{ending}")), "{command:?}: {said}");
                assert!(!said.contains('\t'), "{command:?}: {said}");
            }
        }
    }
    let left: Vec<_> = fs::read_dir(&out).map(|all| all.collect()).unwrap_or_default();
    assert!(left.is_empty(), "{left:?}");
    fs::remove_dir_all(folder).unwrap();
}

/// Not for the superuser, who may read everything.
#[cfg(unix)]
#[test]
fn a_file_that_may_not_be_read_is_named() {
    use std::os::unix::fs::PermissionsExt;

    let folder = folder("forbidden");
    for path in whole(&folder) {
        fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).unwrap();
        if fs::File::open(&path).is_ok() {
            eprintln!("skipped: this user may read {}", path.display());
            continue;
        }
        let file = path.to_str().unwrap();
        for command in commands(file, file, "out") {
            let said = refused(&command);
            assert!(said.contains(file) && said.contains("ermission"), "{command:?}: {said}");
        }
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn where_nothing_can_be_written_the_place_is_named() {
    let folder = folder("full");
    let files = whole(&folder);
    let (surface, sequence) = (files[0].to_str().unwrap(), files[3].to_str().unwrap());
    let file = folder.join("a-file");
    fs::write(&file, "").unwrap();
    let below = file.join("out");
    let below = below.to_str().unwrap();
    for command in [
        vec!["compare", surface, "--gold", surface, "--out", below],
        vec!["reconstruct", sequence, "--calibration", "x.toml", "--out", below],
        vec!["convert", surface, &format!("{below}.ply")],
        vec!["convert", sequence, &format!("{below}.igs.nrrd")],
    ] {
        let said = refused(&command);
        assert!(said.contains("a-file"), "{command:?}: {said}");
    }
    #[cfg(target_os = "linux")]
    for name in ["x.stl", "x.ply", "x.vtp"] {
        let full = folder.join(name);
        std::os::unix::fs::symlink("/dev/full", &full).unwrap();
        let said = refused(&["convert", surface, full.to_str().unwrap()]);
        assert!(said.contains(name) && said.contains("space"), "{said}");
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_seed_is_two_numbers_and_lengths_are_lengths() {
    let out = folder("seed");
    for (seed, code) in [("20,31.5", 1), ("20, 31.5", 1), ("20", 2), ("20,", 2), ("nan,3", 2), ("1,2,3", 2)] {
        let asked = ["reconstruct", "no-such.mcap", "--out", out.to_str().unwrap(), "--seed-mm", seed];
        let done = probepath(&asked);
        let text = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(code), "{seed}: {text}");
        assert!(code == 1 || text.contains("20,31.5"), "{seed}: {text}");
    }
    fs::remove_dir_all(out).unwrap();
}
