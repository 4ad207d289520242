use std::path::PathBuf;

use super::*;

/// A folder with a calibration of the machine that a cell describes: not the nominal one.
fn folder(name: &str, cell: &CellFile) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("probepath-cell-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let nominal = Cell::connect(cell, 1).unwrap().calibration;
    let image_lag = Span::from_milliseconds(-12);
    Calibration { id: "measured".into(), image_lag, ..nominal }
        .write(&folder.join("calibration.toml"))
        .unwrap();
    folder
}

fn cell_file(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("cell.toml");
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_cell_scans_with_the_calibration_that_its_file_names() {
    let folder = folder("uses", &CellFile::default());
    let path = cell_file(&folder, "calibration = \"calibration.toml\"");
    let file = CellFile::read(&path).unwrap();
    let stored = Calibration::read(&folder.join("calibration.toml")).unwrap();
    assert_eq!(Cell::connect(&file, 1).unwrap().calibration, stored);
    // The exam keeps what the file said, so that its bytes do not depend on the folder.
    let text = file.text().unwrap();
    assert!(
        text.contains("calibration = \"calibration.toml\"") && !text.contains("probepath-cell"),
        "{text}"
    );
    assert_eq!(CellFile::parse(&text, "again").unwrap().calibration, file.calibration);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_calibration_of_another_depth_is_refused_with_what_differs_and_what_to_do() {
    let folder = folder("depth", &CellFile::default());
    let path =
        cell_file(&folder, "calibration = \"calibration.toml\"\n[simulated.machine]\ndepth_mm = 50.0\n");
    let error = Cell::connect(&CellFile::read(&path).unwrap(), 1).err().unwrap().to_string();
    let named = folder.join("calibration.toml").display().to_string();
    for words in [&*named, "measured", "depth_mm 50 instead of 70", "scan calibrate"] {
        assert!(error.contains(words), "{words}: {error}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_calibration_that_is_not_there_or_none_is_refused_by_its_name() {
    let folder = folder("none", &CellFile::default());
    for named in ["missing.toml", "cell.toml"] {
        let path = cell_file(&folder, &format!("calibration = \"{named}\""));
        let error = CellFile::read(&path).unwrap_err().to_string();
        assert!(error.contains(&folder.join(named).display().to_string()), "{error}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}
