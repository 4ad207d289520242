//! Damaged files: an error or a sequence that is whole, never a panic, never memory that the file does not hold, and
//! soon.
#![expect(clippy::disallowed_methods, reason = "that reading ends soon is what is tested")]

mod support;

use std::time::{Duration, Instant};

use nalgebra::Vector3;
use probepath_frames::{Point, Probe, Span, Stamp};
use probepath_us_capture::plus::PlusConfig;
use probepath_us_capture::sequence::{
    ChainNames, Header, Placing, ReadOptions, Sequence, SequenceError, SequenceSource,
};
use probepath_us_capture::{BScanSource, PixelMap, PixelSpacing};
use proptest::prelude::*;
use proptest::sample::Index;
use support::{pictures, poses, seeded};

/// Far more than a file of some kilobytes takes on a busy machine, far less than 10^12 pixels would.
const SOON: Duration = Duration::from_secs(10);

/// The most memory the process ever asked for, touched or not, is that of small files (Linux; elsewhere unchecked).
fn check_memory() {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmPeak:"));
    let kilobytes = peak.and_then(|text| text.trim().trim_end_matches(" kB").parse::<u64>().ok());
    assert!(kilobytes.is_none_or(|kb| kb < 3 << 20), "{kilobytes:?} kB");
}

/// What happened to a file on its way.
#[derive(Clone, Debug)]
enum Damage {
    Cut(Index),
    Flip(Index, u8),
    /// One of the header's numbers becomes another.
    Number(Index, &'static str),
    /// A header line goes away, or comes twice.
    Drop(Index),
    Twice(Index),
    Insert(Index, Vec<u8>),
}

const NUMBERS: [&str; 12] = [
    "0",
    "1",
    "-1",
    "2",
    "255",
    "1000000",
    "1000000000000",
    "18446744073709551615",
    "99999999999999999999999",
    "1e400",
    "nan",
    "0x10",
];

fn damage() -> impl Strategy<Value = Damage> {
    let at = any::<Index>;
    prop_oneof![
        1 => at().prop_map(Damage::Cut),
        3 => (at(), any::<u8>()).prop_map(|(i, byte)| Damage::Flip(i, byte)),
        6 => (at(), prop::sample::select(&NUMBERS[..])).prop_map(|(i, n)| Damage::Number(i, n)),
        1 => at().prop_map(Damage::Drop),
        1 => at().prop_map(Damage::Twice),
        1 => (at(), prop::collection::vec(any::<u8>(), 1..20)).prop_map(|(i, bytes)| Damage::Insert(i, bytes)),
    ]
}

/// Where the header's runs of digits are; its end when it is not to be found.
fn digits(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let end = Header::parse(bytes).map_or(bytes.len().min(600), |h| h.payload_at);
    let (mut runs, mut start) = (Vec::new(), None);
    for (at, byte) in bytes[..end].iter().enumerate() {
        match (byte.is_ascii_digit(), start) {
            (true, None) => start = Some(at),
            (false, Some(from)) => {
                runs.push(from..at);
                start = None;
            }
            _ => (),
        }
    }
    runs
}

fn damaged(mut bytes: Vec<u8>, damage: &Damage) -> Vec<u8> {
    if bytes.is_empty() {
        return bytes;
    }
    let line = |bytes: &[u8], i: &Index| {
        let from = i.index(bytes.len());
        let from = bytes[..from].iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
        from..bytes[from..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |at| from + at + 1)
    };
    match damage {
        Damage::Cut(i) => bytes.truncate(i.index(bytes.len())),
        Damage::Flip(i, byte) => {
            let at = i.index(bytes.len());
            bytes[at] ^= byte;
        }
        Damage::Number(i, number) => {
            let runs = digits(&bytes);
            if let Some(run) = (!runs.is_empty()).then(|| runs[i.index(runs.len())].clone()) {
                bytes.splice(run, number.bytes());
            }
        }
        Damage::Drop(i) => drop(bytes.drain(line(&bytes, i))),
        Damage::Twice(i) => {
            let line = line(&bytes, i);
            let copy = bytes[line.clone()].to_vec();
            bytes.splice(line.end..line.end, copy);
        }
        Damage::Insert(i, more) => {
            let at = i.index(bytes.len());
            bytes.splice(at..at, more.iter().copied());
        }
    }
    bytes
}

/// What numbers that only look right do to those who use them: poses, stamps at the ends of time.
fn use_it(sequence: &Sequence) {
    let map = PixelMap::<Probe>::new(Point::new(0.0, 0.0, 0.0), Vector3::x() * 1e-4, Vector3::y() * 1e-4);
    for lag in [Span::ZERO, Span::from_milliseconds(-60)] {
        let chain = ChainNames { reference: "Tracker".into(), ..ChainNames::default() };
        let placing = Placing { chain, lag, ..Placing::new(map) };
        if let Ok(placed) = sequence.place(&placing) {
            let skipped: usize = placed.skipped.values().sum();
            assert_eq!(placed.images.len() + skipped, sequence.images().len());
        }
    }
    let spacing = PixelSpacing { x_m: 1e-4, y_m: 1e-4 };
    let mut source = SequenceSource::new(sequence, spacing, Stamp::ZERO);
    let mut shown = 0;
    while let Ok(Some(_)) = source.poll(Stamp::from_nanoseconds(i64::MAX)) {
        shown += 1;
    }
    assert_eq!(shown + source.skipped(), sequence.images().len() as u64);
}

fn read(bytes: &[u8]) -> Result<Sequence, SequenceError> {
    let header = Header::parse(bytes)?;
    let _named = header.data_file()?;
    let options = ReadOptions { most_bytes: 1 << 20, ..ReadOptions::default() };
    Sequence::assemble(&header, bytes.get(header.payload_at..).unwrap_or_default(), &options)
}

proptest! {
    #![proptest_config(seeded(6000))]

    #[test]
    fn a_damaged_file_is_an_error_or_a_whole_sequence(
        sequence in prop_oneof![3 => pictures(), 1 => poses()],
        nrrd in any::<bool>(),
        damages in prop::collection::vec(damage(), 1..4),
    ) {
        let whole = if nrrd { sequence.to_nrrd() } else { sequence.to_mha() }.unwrap();
        let bytes = damages.iter().fold(whole, damaged);
        let begun = Instant::now();
        let read = read(&bytes);
        prop_assert!(begun.elapsed() < SOON, "{:?}", begun.elapsed());
        match read {
            Err(error) => prop_assert!(!error.to_string().is_empty() && error.to_string().len() < 1500),
            Ok(read) => {
                let size = read.width() * read.height();
                prop_assert!(read.images().iter().all(|i| i.pixels.as_ref().is_none_or(|p| p.len() == size)));
                prop_assert!(read.images().len() < 1 << 15);
                use_it(&read);
            }
        }
        check_memory();
    }
}

proptest! {
    #![proptest_config(seeded(2000))]

    #[test]
    fn a_damaged_configuration_is_an_error_or_numbers(damages in prop::collection::vec(damage(), 1..4)) {
        let bytes = damages.iter().fold(CONFIG.as_bytes().to_vec(), damaged);
        if let Ok(config) = PlusConfig::parse(&String::from_utf8_lossy(&bytes)) {
            for transform in &config.transforms {
                prop_assert!(transform.matrix_mm.iter().all(|x| x.is_finite()));
            }
            if let Some(fan) = config.volume.and_then(|v| v.fan) {
                prop_assert!(fan.origin_px.iter().chain(&fan.angles_rad).all(|x| x.is_finite()));
                prop_assert!(fan.radius_px.is_none_or(|r| r.start.is_finite() && r.stop.is_finite()));
            }
        }
    }
}

const CONFIG: &str = r#"<PlusConfiguration version="2.3">
  <CoordinateDefinitions>
    <Transform From="Image" To="Probe" Matrix="0.1 0 0 1  0 0.2 0 2  0 0 0.1 3  0 0 0 1" Error="0.5" Date="111219"/>
  </CoordinateDefinitions>
  <VolumeReconstruction OutputSpacing="0.5 0.5 0.5" ClipRectangleOrigin="10 20" ClipRectangleSize="300 400"
    FanAngles="-32.0 34.0" FanOrigin="313 7" FanDepth="480" Interpolation="LINEAR" CompoundingMode="MEAN"
    FillHoles="ON">
    <HoleFilling>
      <HoleFillingElement Type="STICK" StickLengthLimit="9" NumberOfSticksToUse="1"/>
    </HoleFilling>
  </VolumeReconstruction>
</PlusConfiguration>
"#;

/// The header of a file that claims a lot and holds little.
fn claims(size: &str, packed: &str, payload: &[u8]) -> Vec<u8> {
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\n{packed}DimSize = {size}\nKinds = domain domain list\n\
         ElementType = MET_UCHAR\nUltrasoundImageOrientation = MF\nElementDataFile = LOCAL\n"
    );
    [header.as_bytes(), payload].concat()
}

#[test]
fn claims_of_ten_to_the_twelve_pixels_are_refused_at_once() {
    let begun = Instant::now();
    for size in ["1000000 1000000 1", "1000 1000 1000000", "2 1 500000000000", "1 1 1000000000000"] {
        for packed in ["", "CompressedData = True\n", "CompressedData = True\nCompressedDataSize = 8\n"] {
            let bytes = claims(size, packed, &[0x78, 0x9c, 0, 0, 0, 0, 0, 1]);
            let header = Header::parse(&bytes).unwrap();
            let payload = &bytes[header.payload_at..];
            for most_bytes in [4 << 30, u64::MAX] {
                let options = ReadOptions { most_bytes, ..ReadOptions::default() };
                let refused = Sequence::assemble(&header, payload, &options).expect_err(size);
                let right =
                    matches!(refused, SequenceError::TooLarge { .. } | SequenceError::CutShort { .. });
                assert!(right, "{size}: {refused}");
            }
        }
    }
    assert!(begun.elapsed() < SOON);
    check_memory();
}

#[test]
fn an_honest_bomb_of_tiny_images_is_refused_by_the_memory_it_would_need() {
    // Twenty million images of two pixels: 40 MB of zeros, 40 kB of stream, gigabytes of images.
    let mut sequence = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    std::io::copy(&mut std::io::Read::take(std::io::repeat(0), 40_000_000), &mut sequence).unwrap();
    let bytes = claims("2 1 20000000", "CompressedData = True\n", &sequence.finish().unwrap());
    let header = Header::parse(&bytes).unwrap();
    let options = ReadOptions { most_bytes: 1 << 30, ..ReadOptions::default() };
    let refused = Sequence::assemble(&header, &bytes[header.payload_at..], &options);
    assert!(matches!(refused, Err(SequenceError::TooLarge { .. })), "{refused:?}");
    check_memory();
}
