//! Damaged phantoms, PLUS configurations and calibrations: an error or something that is whole, never a panic, and soon.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]
#![expect(clippy::disallowed_methods, reason = "that reading ends soon is what is tested")]

use std::path::Path;
use std::time::{Duration, Instant};

use probepath_us_capture::Calibration;
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::plus::PlusConfig;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Each file is damaged so often.
const CASES: u64 = 2000;
/// Far more than a page of text takes on a busy machine.
const SOON: Duration = Duration::from_secs(10);

/// What stands in files and means something, and what never should.
const WORDS: [&str; 30] = [
    "nan",
    "-inf",
    "1e400",
    "-1e308",
    "5e-324",
    "0",
    "-0",
    "1e3",
    "18446744073709551616",
    "0x10",
    "\"",
    "'",
    "\"\"\"",
    "[[wire]]",
    "[wire]",
    "[",
    "]",
    "{",
    "}",
    "=",
    "#",
    "\n",
    "\r\n",
    "<",
    "</",
    "/>",
    "&#0;",
    "&lt;",
    "\u{feff}",
    "µ",
];

fn below(rng: &mut ChaCha8Rng, count: usize) -> usize {
    (rng.next_u64() % count.max(1) as u64) as usize
}

/// One to five things that happen to a file on its way.
fn damaged(whole: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..1 + below(rng, 5) {
        let at = below(rng, bytes.len());
        let end = (at + 1 + below(rng, 40)).min(bytes.len());
        match below(rng, 7) {
            0 => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] ^= 1 << below(rng, 8),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let again = bytes.get(at..end).unwrap_or_default().to_vec();
                bytes.splice(at..at, again);
            }
            4 => swap_lines(&mut bytes, rng),
            5 => other_number(&mut bytes, rng),
            _ => drop(bytes.splice(at..at, WORDS[below(rng, WORDS.len())].bytes())),
        }
    }
    bytes
}

fn swap_lines(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let mut lines: Vec<Vec<u8>> = bytes.split(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    let (a, b) = (below(rng, lines.len()), below(rng, lines.len()));
    lines.swap(a, b);
    *bytes = lines.join(&b'\n');
}

/// A run of digits becomes something else.
fn other_number(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let from = below(rng, bytes.len());
    let Some(start) = bytes.iter().skip(from).position(u8::is_ascii_digit).map(|i| i + from) else { return };
    let run = bytes[start..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
    bytes.splice(start..start + run, WORDS[below(rng, 10)].bytes());
}

/// Every text that damage makes of this file; how many of them were still read.
fn after_damage(name: &str, whole: &str, seed: u64, mut read: impl FnMut(&str) -> bool) {
    assert!(read(whole), "{name} is whole");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut kept = 0;
    for case in 0..CASES {
        let bytes = damaged(whole.as_bytes(), &mut rng);
        let text = String::from_utf8_lossy(&bytes);
        let started = Instant::now();
        kept += u64::from(read(&text));
        assert!(started.elapsed() < SOON, "{name}, case {case}");
    }
    // Comments swallow some damage; most of it is seen.
    assert!((1..CASES).contains(&kept), "{name}: {kept} of {CASES} were read");
}

/// What is read can be written and is read again as it was: nothing half-read gets in.
fn whole_phantom(phantom: &WirePhantom) {
    let text = phantom.to_toml().expect("a phantom that was read is one");
    assert_eq!(WirePhantom::from_toml(&text).expect("its text"), *phantom);
    assert!(phantom.wires.len() >= 3 && phantom.wires.iter().all(|w| w.length_m() > 0.0));
    assert!(phantom.zs.iter().all(|z| phantom.wires_of(*z).is_some()));
}

#[test]
fn damaged_phantoms_are_refused_or_whole() {
    for (seed, name) in WirePhantom::shipped_names().enumerate() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("phantoms/{name}.toml"));
        let text = std::fs::read_to_string(path).expect(name);
        after_damage(name, &text, seed as u64, |text| {
            let read = WirePhantom::from_toml(text);
            read.inspect(whole_phantom).is_ok()
        });
    }
}

/// A configuration with everything that is read, in both layouts of patterns.
const CONFIG: &str = r#"<PlusConfiguration version="2.1">
  <CoordinateDefinitions>
    <Transform From="Phantom" To="Reference" Matrix="0 0 1 9.5 0 1 0 36 -1 0 0 87 0 0 0 1" Error="0.4" Date="012712"/>
    <Transform From="Image" To="Probe" Matrix="0.07 0 0 1 0 0.07 0 2 0 0 0.07 3 0 0 0 1"/>
  </CoordinateDefinitions>
  <Segmentation ApproximateSpacingMmPerPixel="0.078" ClipRectangleOrigin="27 27" ClipRectangleSize="766 562"/>
  <PhantomDefinition>
    <Description Name="fCAL" Version="1.2"/>
    <Geometry>
      <Pattern Type="NWire">
        <Wire Name="1" EndPointFront="20.0 0.0 10.0" EndPointBack="20.0 40.0 10.0"/>
        <Wire Name="2" EndPointFront="40.0 0.0 10.0" EndPointBack="25.0 40.0 10.0"/>
        <Wire Name="3" EndPointFront="45.0 0.0 10.0" EndPointBack="45.0 40.0 10.0"/>
      </Pattern>
      <NWire>
        <Wire Id="4" EndPointFront="20.0 0.0 5.0" EndPointBack="20.0 40.0 5.0"/>
        <Wire Id="5" EndPointFront="25.0 0.0 5.0" EndPointBack="45.0 40.0 5.0"/>
        <Wire Id="6" EndPointFront="50.0 0.0 5.0" EndPointBack="50.0 40.0 5.0"/>
      </NWire>
      <Pattern Type="Single"><Wire EndPointFront="0 0 0" EndPointBack="9 40 0"/></Pattern>
      <Landmarks><Landmark Name="a" Position="95.0 5.0 15.0"/><Landmark Name="b" Position="-25 40 0"/></Landmarks>
      <Registration MatrixName="PhantomToReference" MatrixValue="1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1"/>
    </Geometry>
  </PhantomDefinition>
  <VolumeReconstruction OutputSpacing="0.5 0.5 0.5" ClipRectangleOrigin="0 0" ClipRectangleSize="820 616"
    FanAnglesDeg="-30 30" FanOriginPixel="410 -50" FanRadiusStopPixel="600" FillHoles="OFF"/>
  <vtkPlusProbeCalibrationAlgo ImageCoordinateFrame="Image" PhantomCoordinateFrame="Phantom"/>
</PlusConfiguration>
"#;

/// Everything that a configuration can be asked for.
fn asked(config: &PlusConfig) {
    if let Some(phantom) = &config.phantom {
        whole_phantom(phantom);
    }
    let placed = config.world_from_phantom().ok().flatten();
    assert!(placed.is_none_or(|pose| pose.is_finite()));
    drop(config.pixels_in_probe(&config.frames.image, &config.frames.probe));
}

#[test]
fn damaged_configurations_of_plus_are_refused_or_whole() {
    let mut texts = vec![("ours".to_owned(), CONFIG.to_owned())];
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/plus"));
    if !folder.is_dir() {
        #[allow(clippy::print_stderr, reason = "a skipped test is seen")]
        {
            eprintln!("skipped in part: no folder ../shared/data/plus");
        }
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    for path in entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "xml"))
    {
        let text = std::fs::read_to_string(&path).expect("a text");
        // Results with hundreds of images are long, and all alike.
        if text.len() < 40_000 && PlusConfig::parse(&text).is_ok() {
            texts.push((path.display().to_string(), text));
        }
    }
    texts.sort();
    for (seed, (name, text)) in texts.iter().enumerate() {
        after_damage(name, text, 100 + seed as u64, |text| {
            drop(WirePhantom::from_plus_xml(text).inspect(whole_phantom));
            PlusConfig::parse(text).inspect(asked).is_ok()
        });
    }
}

const CALIBRATION: &str = r#"id = "a"
date = "2026-11-23"
phantom = "z-19"
image_lag_ms = -12.5

[probe_from_image]
written_in = "Probe"
of = "Image"
translation_m = [0.001, -0.002, 0.003]
rotation_xyzw = [0.0, 0.0, 0.0, 1.0]

[setting]
depth_mm = 70.0
focus_mm = 45.0
window_top_mm = 0.0
window_height_mm = 70.0
window_width_mm = 40.0
pixel_x_mm = 0.0625
pixel_y_mm = 0.1458

[error]
rms_mm = 0.4
sd_mm = 0.2
held_out = true
"#;

#[test]
fn damaged_calibrations_are_refused_or_whole() {
    after_damage("a calibration", CALIBRATION, 200, |text| {
        let read = Calibration::from_toml(text);
        let read = read.inspect(|calibration| {
            let again = calibration.to_toml().expect("a calibration that was read is one");
            assert!(Calibration::from_toml(&again).is_ok(), "{again}");
        });
        read.is_ok()
    });
}

#[test]
fn depth_and_number_do_no_harm() {
    let started = Instant::now();
    let deep = format!("{}{}", "<a>".repeat(100_000), "</a>".repeat(100_000));
    assert!(PlusConfig::parse(&deep).is_err());
    assert!(WirePhantom::from_toml(&format!("wire = {}", "[".repeat(100_000))).is_err());
    assert!(WirePhantom::from_toml(&"a.".repeat(100_000)).is_err());
    let wire = "<Wire EndPointFront=\"0 0 0\" EndPointBack=\"0 40 0\"/>".repeat(100_000);
    let many = format!("<PhantomDefinition><Geometry>{wire}</Geometry></PhantomDefinition>");
    let said = WirePhantom::from_plus_xml(&many).expect_err("too many").to_string();
    assert!(said.contains("100000 wires, more than 1000"), "{said}");
    let wire = "[[wire]]\nname = \"a\"\nfront_mm = [0, 0, 0]\nback_mm = [0, 9, 0]\n".repeat(20_000);
    let said = WirePhantom::from_toml(&format!("name = \"many\"\n{wire}")).expect_err("too many").to_string();
    assert!(said.contains("20000 wires, more than 1000"), "{said}");
    assert!(started.elapsed() < SOON);
}
