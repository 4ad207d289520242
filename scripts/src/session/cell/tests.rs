use std::path::{Path, PathBuf};

use super::*;

/// A folder with a calibration of the machine that a cell describes: not the nominal one.
fn folder(name: &str, cell: &CellFile) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("probepath-cell-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let nominal = Cell::connect(cell, 1).unwrap().calibration.unwrap();
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
    assert_eq!(Cell::connect(&file, 1).unwrap().calibration, Some(stored));
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

/// A cell on its wire, as `cells/` has one.
const ON_ITS_WIRE: &str = r#"
name = "a UR beside the table"

[arm]
address = "ur://192.168.56.101"
model = "ur5e"
payload_kg = 0.9
centre_of_gravity_mm = [5.0, 0.0, 70.0]
heartbeat_ms = 12.0

[arm.world_from_base]
written_in = "World"
of = "Base"
translation_mm = [600.0, 0.0, -110.0]
rotation_deg = [90.0, 0.0, 0.0]

[arm.flange_from_probe]
written_in = "Flange"
of = "Probe"
translation_mm = [12.0, 0.0, 165.0]
rotation_deg = [0.0, 0.0, 30.0]

[machine]
address = "igtl://192.168.56.102"
latency_ms = 60.0
clock = "own"
holder_error_mm = 3.0

[machine.setting]
depth_mm = 70.0
focus_mm = 45.0
window_top_mm = 2.0
window_height_mm = 40.0
window_width_mm = 38.0
pixel_x_mm = 0.06
pixel_y_mm = 0.06

[phantom]
model = "z-19"
water_celsius = 21.0

[phantom.world_from_phantom]
written_in = "World"
of = "Phantom"
translation_mm = [100.0, -50.0, 0.0]
rotation_deg = [0.0, 0.0, 0.0]

[workspace.box]
low_mm = [-400.0, -500.0, -600.0]
high_mm = [500.0, 0.0, 400.0]

[[workspace.planes]]
through_mm = [450.0, 0.0, 0.0]
inward = [-1.0, 0.0, 0.0]
"#;

fn refused(text: &str) -> String {
    CellFile::parse(text, "cell.toml").unwrap_err().to_string()
}

#[test]
fn a_cell_on_its_wire_is_read_and_written_without_a_simulated_one() {
    let file = CellFile::parse(ON_ITS_WIRE, "cell.toml").unwrap();
    assert!(!file.is_simulated());
    assert_eq!(file.arm.address, Address::Ur { host: "192.168.56.101".into() });
    assert_eq!(file.machine.address, MachineAddress::Igtl { host: "192.168.56.102".into(), port: IGTL_PORT });
    let text = file.text().unwrap();
    assert!(!text.contains("simulated"), "{text}");
    assert_eq!(CellFile::parse(&text, "again").unwrap(), file);
    let described = Described::on_its_wire(&file, None).unwrap();
    assert!((described.facts.flange_from_probe.origin().vector().z - 0.165).abs() < 1e-12);
    assert_eq!(described.image_latency, Span::from_milliseconds(60));
}

#[test]
fn a_file_of_before_arms_had_addresses_is_the_simulated_cell() {
    let old = "name = \"old\"\n[force]\nsoft_n = 8.0\n[simulated.hand]\nlength_mm = 40.0\n";
    let file = CellFile::parse(old, "old.toml").unwrap();
    assert!(file.is_simulated() && file.simulated.hand.length_mm < 41.0);
    assert_eq!(CellFile::parse(&file.text().unwrap(), "again").unwrap(), file);
}

#[test]
fn every_wrong_field_is_refused_with_its_line_and_its_name() {
    let wrong = [
        ("payload_kg = 0.9", "payload_kg = -0.9", "line 7: arm.payload_kg is -0.9"),
        ("payload_kg = 0.9", "payload_kg = nan", "line 7: arm.payload_kg is NaN"),
        ("payload_kg = 0.9", "", "line 4: arm.payload_kg is missing"),
        ("payload_kg = 0.9", "payload_g = 900.0", "payload_g"),
        ("payload_kg = 0.9", "payload_kg = \"0.9 kg\"", "line 7"),
        ("[5.0, 0.0, 70.0]", "[5.0, 0.0, 7000.0]", "line 8: arm.centre_of_gravity_mm is 7000"),
        ("[5.0, 0.0, 70.0]", "[5.0, 70.0]", "line 8"),
        (
            "heartbeat_ms = 12.0",
            "accuracy_mm = 0.1",
            "line 9: arm.accuracy_mm is given without repeatability_mm",
        ),
        (
            "heartbeat_ms = 12.0",
            "repeatability_mm = 0.1",
            "arm.repeatability_mm is given without accuracy_mm",
        ),
        (
            "heartbeat_ms = 12.0",
            "accuracy_mm = 0.1\nrepeatability_mm = nan",
            "line 10: arm.repeatability_mm is NaN",
        ),
        ("heartbeat_ms = 12.0", "heartbeat_ms = 0.5", "line 9: arm.heartbeat_ms is 0.5"),
        ("written_in = \"World\"", "written_in = \"Flange\"", "line 11: arm.world_from_base is no pose"),
        ("rotation_deg = [90.0, 0.0, 0.0]", "rotation_rad = [1.57, 0.0, 0.0]", "rotation_rad"),
        ("rotation_deg = [90.0, 0.0, 0.0]", "rotation_deg = [9000.0, 0.0, 0.0]", "line 15"),
        ("model = \"ur5e\"", "model = \"mine.urdf\"", "line 6: arm.model does not go together"),
        ("ur://192.168.56.101", "ur://192.168.56.101:30004", "a controller always has its own"),
        ("ur://192.168.56.101", "192.168.56.101", "line 5"),
        ("ur://192.168.56.101", "ur://", "names no host"),
        ("ur://192.168.56.101", "sim", "line 6: arm.model is given"),
        ("igtl://192.168.56.102", "igtl://192.168.56.102:http", "igtl://host"),
        ("igtl://192.168.56.102", "igtl://192.168.56.102:0", "igtl://host"),
        ("igtl://192.168.56.102", "none", "machine.latency_ms is given"),
        ("latency_ms = 60.0", "latency_ms = 60000.0", "machine.latency_ms is 60000"),
        ("latency_ms = 60.0", "latency_s = 0.06", "latency_s"),
        ("clock = \"own\"", "clock = \"wall\"", "clock"),
        ("depth_mm = 70.0", "depth_mm = 0.07", "machine.setting.depth_mm is 0.07"),
        ("window_height_mm = 40.0", "window_height_mm = 80.0", "machine.setting.window_height_mm is 80"),
        ("pixel_x_mm = 0.06", "pixel_x_mm = 60.0", "machine.setting.pixel_x_mm is 60"),
        ("low_mm = [-400.0", "low_mm = [600.0", "workspace.box.high_mm"),
        ("inward = [-1.0, 0.0, 0.0]", "inward = [0.0, 0.0, 0.0]", "workspace.planes has no `inward`"),
        ("name = \"a UR beside the table\"", "[simulated]\nseed = 1", "seed"),
        ("water_celsius = 21.0", "water_celsius = 294.0", "phantom.water_celsius is 294"),
        ("of = \"Phantom\"", "of = \"Probe\"", "phantom.world_from_phantom is no pose"),
    ];
    for (right, written, said) in wrong {
        assert!(ON_ITS_WIRE.contains(right), "{right}");
        let text = refused(&ON_ITS_WIRE.replace(right, written));
        assert!(text.contains("cell.toml") && text.contains(said), "{written}: {text}");
    }
}

#[test]
fn a_phantom_on_the_table_is_found_by_its_name_and_one_that_is_none_is_named() {
    let file = CellFile::parse(ON_ITS_WIRE, "cell.toml").unwrap();
    let bench = Described::on_its_wire(&file, None).unwrap().bench.unwrap();
    assert!((bench.water_celsius - 21.0).abs() < 1e-12 && !bench.phantom.wires.is_empty());
    assert!((bench.world_from_phantom.origin().vector().y + 0.05).abs() < 1e-12);
    let none = CellFile::parse(&ON_ITS_WIRE.replace("model = \"z-19\"", "model = \"no.toml\""), "cell.toml");
    let error = Described::on_its_wire(&none.unwrap(), None).err().unwrap().to_string();
    assert!(error.contains("phantom.model is \"no.toml\"") && error.contains("come along"), "{error}");
    let here = ON_ITS_WIRE.split_once("[phantom]").unwrap().1;
    let text = refused(&format!("[phantom]{}", here.split_once("[workspace").unwrap().0));
    assert!(text.contains("[simulated.subject.wire_phantom]"), "{text}");
}

#[test]
fn what_never_meets_is_refused() {
    let both = format!("{ON_ITS_WIRE}\n[simulated.hand]\nlength_mm = 40.0\n");
    assert!(refused(&both).contains("[simulated] describes a cell"), "{}", refused(&both));
    let (alone, _) = ON_ITS_WIRE.split_once("[machine]").unwrap();
    let text = refused(alone);
    assert!(text.contains("machine.address is \"sim\", and the arm's is not"), "{text}");
    let text = refused("[machine]\naddress = \"igtl://127.0.0.1\"\n");
    assert!(text.contains("machine.latency_ms is missing"), "{text}");
}

#[test]
fn an_arm_alone_has_no_calibration_and_looking_is_refused() {
    let file = CellFile::parse("[machine]\naddress = \"none\"\n", "cell.toml").unwrap();
    let cell = Cell::connect(&file, 1).unwrap();
    assert!(cell.machine.is_none() && matches!(cell.calibrated(), Err(SessionError::NoMachine)));
}

#[test]
fn the_image_lies_where_the_simulated_holder_is_drawn() {
    let simulated = SimulatedCell::new(&CellFile::default().simulated, 1).unwrap();
    let nominal = simulated.nominal();
    let (ours, theirs) = (as_drawn(&nominal.setting), nominal.probe_from_image(&nominal.setting));
    for pixel in [(0.0, 0.0), (300.0, 500.0)] {
        let at = nominal.setting.spacing.point(pixel.0, pixel.1);
        assert!((ours * at).distance(&(theirs * at)) < 1e-12);
    }
}

#[test]
fn the_probe_stays_in_the_box_and_on_the_planes_inner_side() {
    let file = CellFile::parse(ON_ITS_WIRE, "cell.toml").unwrap();
    let file = CellFile { arm: ArmFile::default(), machine: MachineFile::default(), ..file };
    let cell = Cell::connect(&file, 1).unwrap();
    let base_from_world = cell.facts.world_from_base.inverse();
    let inside = base_from_world * Point::<World>::new(0.1, -0.3, 0.0);
    let workspace = cell.workspace();
    for (x, y, z) in [(0.1, -0.6, 0.0), (0.48, -0.3, 0.0), (-0.5, -0.3, 0.0), (0.1, -0.01, 0.0)] {
        let outside = base_from_world * Point::<World>::new(x, y, z);
        assert!(workspace.crossed(&outside, &inside).is_some(), "{x} {y} {z}");
        assert!(workspace.crossed(&inside, &outside).is_none(), "{x} {y} {z}");
    }
}

#[test]
fn the_file_says_how_old_a_state_may_be_in_every_motion() {
    let file = CellFile::parse("[arm]\nheartbeat_ms = 20.0\n", "cell.toml").unwrap();
    let cell = Cell::connect(&file, 1).unwrap();
    assert_eq!(cell.guard_limits().heartbeat, Span::from_milliseconds(20));
    let guiding = cell.as_the_file_says(GuardLimits::hand_guiding());
    assert_eq!(guiding.heartbeat, Span::from_milliseconds(20));
    assert_eq!(
        GuardLimits { heartbeat: GuardLimits::default().heartbeat, ..guiding },
        GuardLimits::hand_guiding()
    );
}

#[test]
fn the_shipped_cell_is_what_the_simulated_one_says_of_itself() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../cells/ur_sim.toml");
    let shipped = CellFile::read(Path::new(path)).unwrap();
    let simulated = SimulatedCell::new(&CellFile::default().simulated, 1).unwrap();
    let host = std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);
    let served = CellFile::of_served(&shipped.name, &simulated, host, ControllerTime::Wall);
    let [ours, theirs] = [&shipped, &served].map(|file| Described::on_its_wire(file, None).unwrap());
    let off =
        |a: &Pose<World, probepath_frames::Base>, b: &Pose<World, probepath_frames::Base>| a.distance(b);
    let (m, rad) = off(&ours.facts.world_from_base, &theirs.facts.world_from_base);
    assert!(m < 1e-9 && rad < 1e-7, "{m} m, {rad} rad");
    let (m, rad) = ours.facts.flange_from_probe.distance(&theirs.facts.flange_from_probe);
    assert!(m < 1e-9 && rad < 1e-7, "{m} m, {rad} rad");
    let [ours, theirs] = [&shipped, &served].map(|file| file.machine.setting.unwrap().metres());
    assert!((ours.spacing.y_m - theirs.spacing.y_m).abs() < 1e-15);
    assert!((ours.depth_m - theirs.depth_m).abs() < 1e-12);
    assert!((ours.window_top_m - theirs.window_top_m).abs() < 1e-12);
    // Everything else to the letter.
    let alike = |file: &CellFile| {
        let mut file = file.clone();
        (file.arm.world_from_base, file.arm.flange_from_probe) = (None, None);
        (file.machine.setting, file.workspace, file.folder) =
            (None, WorkspaceFile::default(), Default::default());
        file
    };
    assert_eq!(alike(&shipped), alike(&served));
    assert!(shipped.text().is_ok_and(|text| CellFile::parse(&text, "again").is_ok()));
}
