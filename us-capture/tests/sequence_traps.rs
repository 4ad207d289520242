//! The traps of tracked sequence files that no file of PLUS at hand has.
#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::io::Write;

use probepath_us_capture::sequence::{
    Header, Note, Orientation, ReadOptions, Sequence, SequenceError, Status, TransformName,
};

const IDENTITY: &str = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";

/// A MetaImage file of these lines before the payload.
fn mha(lines: &[&str], payload: &[u8]) -> Vec<u8> {
    let text = format!("ObjectType = Image\nNDims = 3\n{}\nElementDataFile = LOCAL\n", lines.join("\n"));
    [text.as_bytes(), payload].concat()
}

/// Two images of 3 x 2 with nothing unusual, but for these lines.
fn usual(more: &[&str]) -> Vec<u8> {
    let mut lines = vec!["DimSize = 3 2 2", "Kinds = domain domain list", "ElementType = MET_UCHAR"];
    lines.extend(more);
    mha(&lines, &PIXELS)
}

const MF: &str = "UltrasoundImageOrientation = MF";
const PIXELS: [u8; 12] = [1, 2, 3, 4, 5, 6, 11, 12, 13, 14, 15, 16];

fn read_with(bytes: &[u8], options: &ReadOptions) -> Result<Sequence, SequenceError> {
    let header = Header::parse(bytes)?;
    Sequence::assemble(&header, &bytes[header.payload_at..], options)
}

fn read(bytes: &[u8]) -> Result<Sequence, SequenceError> {
    read_with(bytes, &ReadOptions::default())
}

fn pixels(sequence: &Sequence) -> Vec<u8> {
    sequence.images().iter().flat_map(|i| i.pixels.as_deref().unwrap().iter().copied()).collect()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut stream = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    stream.write_all(bytes).unwrap();
    stream.finish().unwrap()
}

#[test]
fn images_of_every_orientation_come_as_mf_pixel_by_pixel() {
    for (said, turned) in [
        ("MF", PIXELS),
        ("MFA", PIXELS),
        ("UF", [3, 2, 1, 6, 5, 4, 13, 12, 11, 16, 15, 14]),
        ("UFA", [3, 2, 1, 6, 5, 4, 13, 12, 11, 16, 15, 14]),
        ("MN", [4, 5, 6, 1, 2, 3, 14, 15, 16, 11, 12, 13]),
        ("UN", [6, 5, 4, 3, 2, 1, 16, 15, 14, 13, 12, 11]),
        ("UNA", [6, 5, 4, 3, 2, 1, 16, 15, 14, 13, 12, 11]),
    ] {
        let sequence = read(&usual(&[&format!("UltrasoundImageOrientation = {said}")])).unwrap();
        assert_eq!(pixels(&sequence), turned, "{said}");
        let noted = sequence.notes().iter().any(|n| matches!(n, Note::Turned { .. }));
        assert_eq!(noted, !said.starts_with("MF"), "{said}");
    }
}

#[test]
fn an_odd_row_in_the_middle_stays_when_rows_are_flipped() {
    let mut pixels: Vec<u8> = (0..15).collect();
    Orientation::Un.bring_to_mf(&mut pixels, 3);
    assert!(pixels.iter().copied().eq((0..15).rev()));
    Orientation::Mn.bring_to_mf(&mut pixels, 3);
    assert_eq!(pixels, [2, 1, 0, 5, 4, 3, 8, 7, 6, 11, 10, 9, 14, 13, 12]);
}

#[test]
fn a_missing_orientation_is_refused_and_an_assumed_one_is_noted() {
    for lines in [&[][..], &["UltrasoundImageOrientation = "], &["UltrasoundImageOrientation = XX"]] {
        let bytes = usual(lines);
        assert!(matches!(read(&bytes), Err(SequenceError::NoOrientation)));
        let options = ReadOptions { assume_orientation: Some(Orientation::Uf), ..ReadOptions::default() };
        let sequence = read_with(&bytes, &options).unwrap();
        assert!(sequence.notes().contains(&Note::OrientationAssumed(Orientation::Uf)));
        assert_eq!(pixels(&sequence)[..3], [3, 2, 1]);
    }
    let options = ReadOptions { assume_orientation: Some(Orientation::Uf), ..ReadOptions::default() };
    let said = read_with(&usual(&[MF]), &options).unwrap();
    assert_eq!(pixels(&said), PIXELS, "what the file says comes first");
}

#[test]
fn rf_lines_are_refused_by_orientation_and_by_kind() {
    for said in ["FM", "NM", "FU", "NU", "FMA"] {
        let refused = read(&usual(&[&format!("UltrasoundImageOrientation = {said}")]));
        assert!(matches!(refused, Err(SequenceError::RfLines { .. })), "{said}");
    }
    for kind in ["RF_REAL", "RF_IQ_LINE", "RF_I_LINE_Q_LINE"] {
        let refused = read(&usual(&[MF, &format!("UltrasoundImageType = {kind}")]));
        assert!(matches!(refused, Err(SequenceError::Unsupported { .. })), "{kind}");
    }
    let unknown = read(&usual(&["UltrasoundImageOrientation = MFD"]));
    assert!(matches!(unknown, Err(SequenceError::Unsupported { .. })));
}

#[test]
fn an_image_nobody_speaks_of_keeps_its_place_and_is_noted() {
    let sequence = read(&usual(&[MF, "Seq_Frame0001_Timestamp = 2.5"])).unwrap();
    assert_eq!(sequence.images().len(), 2);
    assert_eq!(sequence.images()[0].stamp, None);
    assert_eq!(sequence.images()[1].stamp.unwrap().nanoseconds(), 2_500_000_000);
    assert!(sequence.notes().contains(&Note::NothingSaid { images: 1, first: 0 }));
    let beyond = read(&usual(&[MF, "Seq_Frame0002_Timestamp = 2.5"]));
    assert!(matches!(beyond, Err(SequenceError::BeyondLast { number: 2, images: 2, .. })));
    let far = read(&usual(&[MF, "Seq_Frame99999999999999999999_Timestamp = 2.5"]));
    assert!(matches!(far, Err(SequenceError::BeyondLast { images: 2, .. })));
}

#[test]
fn four_digits_are_a_minimum() {
    let payload = vec![7; 2 * 10_002];
    let lines = [
        "DimSize = 2 1 10002",
        "Kinds = domain domain list",
        "ElementType = MET_UCHAR",
        MF,
        "Seq_Frame9999_Timestamp = 1",
        "Seq_Frame10000_Timestamp = 2",
        "Seq_Frame10001_ImageStatus = INVALID",
    ];
    let sequence = read(&mha(&lines, &payload)).unwrap();
    let second = |number: usize| sequence.images()[number].stamp.map(|s| s.nanoseconds() / 1_000_000_000);
    assert_eq!((second(9999), second(10_000), second(10_001)), (Some(1), Some(2), None));
    assert!(sequence.images()[10_001].picture().is_none());
    let again = sequence.to_mha().unwrap();
    assert_eq!(read(&again).unwrap().images(), sequence.images());
}

#[test]
fn poses_of_nan_are_read_where_marked_and_refused_where_not() {
    let nan = IDENTITY.replace('0', "NaN");
    let pose = format!("Seq_Frame0001_ProbeToTrackerTransform = {nan}");
    let marked = read(&usual(&[MF, &pose, "Seq_Frame0001_ProbeToTrackerTransformStatus = INVALID"])).unwrap();
    let name = TransformName::new("Probe", "Tracker");
    assert_eq!(marked.images()[1].transforms[&name].status, Status::Invalid);
    for lines in [&[MF, &pose][..], &[MF, &pose, "Seq_Frame0001_ProbeToTrackerTransformStatus = OK"]] {
        match read(&usual(lines)) {
            Err(SequenceError::BadValue { line, key, .. }) => {
                assert_eq!((line, key.as_str()), (7, "Seq_Frame0001_ProbeToTrackerTransform"));
            }
            other => panic!("{other:?}"),
        }
    }
    let short = read(&usual(&[MF, "Seq_Frame0001_ProbeToTrackerTransform = 1 0 0"]));
    assert!(matches!(short, Err(SequenceError::BadValue { .. })));
}

#[test]
fn kinds_may_stand_before_or_after_the_sizes_and_keys_in_any_order() {
    let mut lines = vec![
        MF,
        "ElementType = MET_UCHAR",
        "DimSize = 3 2 2   ",
        "Kinds = domain  domain             list  ",
    ];
    for _ in 0..lines.len() {
        lines.rotate_left(1);
        assert_eq!(pixels(&read(&mha(&lines, &PIXELS)).unwrap()), PIXELS);
        let backwards: Vec<&str> = lines.iter().rev().copied().collect();
        assert_eq!(pixels(&read(&mha(&backwards, &PIXELS)).unwrap()), PIXELS);
    }
}

#[test]
fn the_last_axis_counts_images_only_when_its_kind_says_so() {
    let with = |kinds: &str| {
        let kinds = format!("Kinds = {kinds}");
        read(&mha(&["DimSize = 3 2 2", &kinds, "ElementType = MET_UCHAR", MF], &PIXELS))
    };
    assert_eq!(with("domain domain list").unwrap().images().len(), 2);
    assert_eq!(with("domain domain time").unwrap().images().len(), 2);
    for volume in ["domain domain domain", "domain domain space", "list domain domain"] {
        assert!(matches!(with(volume), Err(SequenceError::NotASequence { .. })), "{volume}");
    }
    assert!(with("domain list").is_err(), "three sizes, two kinds");
    let unnamed = ["DimSize = 3 2 2", "ElementType = MET_UCHAR", MF];
    assert!(matches!(read(&mha(&unnamed, &PIXELS)), Err(SequenceError::NotASequence { .. })));
    let said = [&unnamed[..], &["Seq_Frame0000_Timestamp = 1", "Seq_Frame0001_Timestamp = 2"]].concat();
    assert!(read(&mha(&said, &PIXELS)).unwrap().notes().contains(&Note::KindsUnsaid));
}

#[test]
fn colour_becomes_grey_in_both_formats() {
    // Red, green, blue and white of ITU-R BT.601: 0.299, 0.587, 0.114.
    let rgb = [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    let lines = [
        "DimSize = 2 2 1",
        "Kinds = domain domain list",
        "ElementType = MET_UCHAR",
        "ElementNumberOfChannels = 3",
        MF,
    ];
    let meta = read(&mha(&lines, &rgb)).unwrap();
    let text = "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 2 2 1\nkinds: vector domain domain list\nencoding: raw\n\
                ultrasound image orientation:=UF\n\n";
    let nrrd = read(&[text.as_bytes(), &rgb].concat()).unwrap();
    assert_eq!(pixels(&meta), [76, 150, 29, 255]);
    assert_eq!(pixels(&nrrd), [150, 76, 255, 29], "grey first, then turned by whole pixels");
    assert!(meta.notes().contains(&Note::ColourToGrey { channels: 3 }));
    let two = lines.map(|l| l.replace("Channels = 3", "Channels = 2"));
    let two: Vec<&str> = two.iter().map(String::as_str).collect();
    assert!(matches!(read(&mha(&two, &rgb)), Err(SequenceError::Unsupported { .. })));
}

#[test]
fn numbers_are_read_as_windows_prints_them() {
    let pose = "Seq_Frame0000_ProbeToTrackerTransform =  1 -8.43482e-005  0.000190641 -0.370779 8.39344e-005 1 0 \
                1.5e+002 -0 0 1 -1949.07   0 0 0 1 ";
    let sequence = read(&usual(&[MF, pose])).unwrap();
    let matrix = sequence.images()[0].transforms[&TransformName::new("Probe", "Tracker")].matrix_mm;
    assert_eq!((matrix[(0, 1)], matrix[(1, 3)], matrix[(2, 3)]), (-8.43482e-5, 150.0, -1949.07));
    assert!(matrix[(2, 0)].is_sign_negative() && matrix[(2, 0)] == 0.0);
}

#[test]
fn absent_statuses_are_used_and_counted_and_one_without_a_pose_stays() {
    let pose = format!("Seq_Frame0000_ProbeToTrackerTransform = {IDENTITY}");
    let lone = "Seq_Frame0001_ProbeToTrackerTransformStatus = MISSING";
    let sequence = read(&usual(&[MF, &pose, lone, "Seq_Frame0001_ImageStatus = INVALID"])).unwrap();
    assert!(sequence.notes().contains(&Note::ImageStatusUnsaid { images: 1 }));
    let unsaid = Note::PoseStatusUnsaid { name: "ProbeToTracker".into(), images: 1 };
    assert!(sequence.notes().contains(&unsaid));
    assert!(sequence.images()[0].picture().is_some() && sequence.images()[1].picture().is_none());
    assert_eq!(sequence.images()[1].fields["ProbeToTrackerTransformStatus"], "MISSING");
    assert_eq!(read(&sequence.to_nrrd().unwrap()).unwrap().images(), sequence.images());
}

#[test]
fn a_compressed_stream_that_is_cut_or_flipped_anywhere_is_refused() {
    let stream = zlib(&PIXELS);
    let file = |size: usize, payload: &[u8]| {
        let size = format!("CompressedDataSize = {size}");
        let lines = [
            "CompressedData = True",
            &size,
            "DimSize = 3 2 2",
            "Kinds = domain domain list",
            "ElementType = MET_UCHAR",
            MF,
        ];
        read(&mha(&lines, payload))
    };
    assert_eq!(pixels(&file(stream.len(), &stream).unwrap()), PIXELS);
    for kept in 0..stream.len() {
        assert!(file(kept, &stream[..kept]).is_err(), "cut at {kept}, the header agrees");
        assert!(matches!(file(stream.len(), &stream[..kept]), Err(SequenceError::CutShort { .. })), "{kept}");
    }
    let longer = [&stream[..], &[0]].concat();
    assert!(matches!(file(stream.len(), &longer), Err(SequenceError::TooLong { .. })));
    assert!(matches!(file(longer.len(), &longer), Err(SequenceError::TooLong { .. })));
    assert!(file(stream.len() - 1, &stream).is_err() && file(stream.len() + 1, &stream).is_err());
    for bit in 0..8 * stream.len() {
        let mut flipped = stream.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(read) = file(stream.len(), &flipped) {
            assert_eq!(pixels(&read), PIXELS, "bit {bit}: what is not noticed does not matter");
        }
    }
}

#[test]
fn a_gzip_stream_that_is_cut_or_longer_is_refused() {
    let mut stream = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    stream.write_all(&PIXELS).unwrap();
    let stream = stream.finish().unwrap();
    let text = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 2 2\nkinds: domain domain list\nencoding: gz\n\
                ultrasound image orientation:=MF\n\n";
    let file = |payload: &[u8]| read(&[text.as_bytes(), payload].concat());
    assert_eq!(pixels(&file(&stream).unwrap()), PIXELS);
    for kept in 0..stream.len() {
        assert!(file(&stream[..kept]).is_err(), "cut at {kept}");
    }
    assert!(matches!(file(&[&stream[..], &[0]].concat()), Err(SequenceError::TooLong { .. })));
}

#[test]
fn raw_pixels_have_to_be_as_many_as_claimed() {
    let whole = usual(&[MF]);
    assert!(matches!(
        read(&whole[..whole.len() - 1]),
        Err(SequenceError::CutShort { needs: 12, holds: 11, .. })
    ));
    let longer = [&whole[..], &[0]].concat();
    assert!(matches!(read(&longer), Err(SequenceError::TooLong { needs: 12, holds: 13, .. })));
    let negative = String::from_utf8_lossy(&whole).replace("3 2 2", "3 -2 2");
    assert!(matches!(read(negative.as_bytes()), Err(SequenceError::BadValue { line: 3, .. })));
    for size in ["0 2 2", "3 0 2"] {
        let flat = String::from_utf8_lossy(&whole).replace("3 2 2", size);
        assert!(matches!(read(flat.as_bytes()), Err(SequenceError::BadValue { line: 3, .. })), "{size}");
    }
}

#[test]
fn poses_without_images_are_as_many_as_the_header_speaks_of() {
    let one = format!("Seq_Frame0001_ProbeToTrackerTransform = {IDENTITY}");
    let two = format!("Seq_Frame0003_ProbeToTrackerTransform = {IDENTITY}");
    for (size, kind, payload) in [
        ("DimSize = 0 0 4", "ElementType = MET_OTHER", 0),
        ("DimSize = 1 1 4", "ElementType = MET_OTHER", 0),
        ("DimSize = 1 1 4", "ElementType = MET_UCHAR", 4),
    ] {
        let lines = [size, "Kinds = domain domain list", kind, "UltrasoundImageOrientation = XX", &one, &two];
        let sequence = read(&mha(&lines, &vec![0; payload])).unwrap();
        assert_eq!((sequence.width(), sequence.height()), (0, 0), "{size}");
        let numbers: Vec<u64> = sequence.images().iter().map(|i| i.number).collect();
        assert_eq!(numbers, [1, 3], "{size}");
        assert!(sequence.notes().contains(&Note::NoPictures));
        assert!(sequence.notes().contains(&Note::NothingSaid { images: 2, first: 0 }), "{size}");
        assert!(sequence.images().iter().all(|i| i.pixels.is_none()));
    }
    let real = ["DimSize = 3 2 2", "Kinds = domain domain list", "ElementType = MET_OTHER", MF];
    assert!(matches!(read(&mha(&real, &PIXELS)), Err(SequenceError::Unsupported { .. })));
}

#[test]
fn keys_that_contradict_each_other_are_refused() {
    let refused = read(&usual(&[MF, "DimSize = 2 3 2"]));
    assert!(matches!(refused, Err(SequenceError::BadValue { line: 7, .. })), "{refused:?}");
    assert!(read(&usual(&[MF, MF])).is_ok(), "the same thing said twice is one thing");
}

#[test]
fn a_payload_beside_its_header_is_read_and_one_elsewhere_is_refused() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("sequence-traps");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("a.raw"), PIXELS).unwrap();
    let meta = String::from_utf8(usual(&[MF])[..usual(&[MF]).len() - PIXELS.len()].to_vec()).unwrap();
    let nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 2 2\nkinds: domain domain list\nencoding: raw\n\
                ultrasound image orientation:=MF\ndata file: LOCAL\n";
    let from = |file: &str, header: &str, name: &str| {
        std::fs::write(folder.join(file), header.replace("LOCAL", name)).unwrap();
        Sequence::read(&folder.join(file), &ReadOptions::default())
    };
    for (file, header) in [("a.mhd", &meta[..]), ("a.nhdr", nrrd)] {
        assert_eq!(pixels(&from(file, header, "a.raw").unwrap()), PIXELS, "{file}");
        for name in ["../a.raw", "/etc/hostname", "..", "LIST", "a%03d.raw 1 10 1", "b\\a.raw"] {
            let refused = from(file, header, name);
            assert!(matches!(refused, Err(SequenceError::Unsupported { .. })), "{file} {name}");
        }
        assert!(matches!(from(file, header, "none.raw"), Err(SequenceError::Disk { .. })), "{file}");
    }
}
