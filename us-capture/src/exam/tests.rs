use std::borrow::Cow;
use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use probepath_frames::nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Span, Stamp, Wrench};

use super::*;
use crate::{BScan, PixelSpacing, PlacedBScan, Setting};

mod damage;
mod disk;
mod schemas;

/// A small generator (splitmix64): noise that is the same everywhere.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn real(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    fn row(&mut self) -> Row {
        let numbers: Vec<f64> = (0..6).map(|_| self.real()).collect();
        Row::from_slice(&numbers).unwrap()
    }

    fn pose<A: probepath_frames::Frame, B: probepath_frames::Frame>(&mut self) -> Pose<A, B> {
        let mut vector = || Vector3::new(self.real(), self.real(), self.real());
        // FRAMES: made up for the test.
        Pose::assume(Isometry3::new(vector(), vector() * 6.0))
    }
}

pub(crate) fn header() -> ExamHeader {
    ExamHeader {
        software: "probepath 0.1.0".into(),
        study_code: "LEG-007".into(),
        protocol: "femoral".into(),
        protocol_sha256: ExamHeader::sha256("scan(mm(200));"),
        calibration_id: "z-7cm".into(),
        seed: Some(42),
        joint_names: (1..=6).map(|n| format!("joint {n}")).collect(),
        period: Span::from_milliseconds(2),
    }
}

pub(crate) fn tick(n: u64, noise: &mut Noise) -> TickRecord {
    TickRecord {
        tick: n,
        stamp: Stamp::from_nanoseconds(2_000_000 * i64::try_from(n).unwrap()),
        command: (!n.is_multiple_of(7)).then(|| noise.row()),
        position: noise.row(),
        velocity: noise.row(),
        commanded: noise.row(),
        wrench: Wrench::new(Vector3::new(noise.real(), -0.0, 5e-324), Vector3::repeat(noise.real())),
        guiding: n.is_multiple_of(3),
        phase: Cow::Borrowed(if n < 100 { "approach" } else { "replay" }),
        world_from_probe: (!n.is_multiple_of(11)).then(|| noise.pose()),
        safety: Cow::Borrowed(if n.is_multiple_of(13) { "reduced" } else { "" }),
        freedrive: n.is_multiple_of(28),
        overtaken: n.is_multiple_of(9),
        age: Span::from_nanoseconds(if n.is_multiple_of(5) { n as i64 } else { 0 }),
    }
}

pub(crate) fn placed(n: u64, (width, height): (usize, usize), noise: &mut Noise) -> PlacedBScan {
    let setting = Setting {
        depth_m: 0.07,
        focus_m: 0.045,
        window_top_m: 0.02,
        window_height_m: 0.03,
        window_width_m: 0.04,
        spacing: PixelSpacing { x_m: 0.04 / width as f64, y_m: 0.03 / height as f64 },
    };
    let pixels: Vec<u8> =
        (0..width * height).map(|_| ((noise.next() >> 56) as u8).min(noise.next() as u8)).collect();
    let formed = Stamp::from_nanoseconds(40_000_000 * i64::try_from(n).unwrap() - 60_000_000);
    let stamps = (formed, formed + Span::from_milliseconds(80));
    PlacedBScan {
        bscan: BScan::new(n, stamps, setting, (width, height), pixels).unwrap(),
        world_from_probe: noise.pose(),
        world_from_image: noise.pose(),
        wrench: (n % 4 != 3).then(|| Wrench::new(Vector3::repeat(noise.real()), Vector3::zeros())),
    }
}

/// What a session would record: attachments, then ticks with a B-scan every 20, then a report.
pub(crate) fn events(ticks: u64, size: (usize, usize)) -> Vec<ExamEvent> {
    let mut noise = Noise(7);
    let mut all = vec![
        ExamEvent::Attachment(Attachment::urdf("<robot/>")),
        ExamEvent::Attachment(Attachment::protocol("scan(mm(200));")),
    ];
    for n in 0..ticks {
        let record = tick(n, &mut noise);
        if n % 500 == 3 {
            let text = format!("tick {n}: é");
            all.push(ExamEvent::Event(Event {
                stamp: record.stamp,
                level: [Level::Info, Level::Warning, Level::Error][(n / 500 % 3) as usize],
                source: "session".into(),
                text,
            }));
        }
        all.push(ExamEvent::Tick(record));
        if n % 20 == 19 {
            all.push(ExamEvent::BScan(placed(n / 20, size, &mut noise)));
        }
    }
    all.push(ExamEvent::Attachment(Attachment::report("<html/>")));
    all
}

pub(crate) fn put<W: Write>(file: &mut ExamFile<W>, event: &ExamEvent) -> Result<(), ExamError> {
    match event {
        ExamEvent::Tick(tick) => file.tick(tick),
        ExamEvent::BScan(placed) => file.bscan(placed),
        ExamEvent::Event(event) => file.event(event),
        ExamEvent::Attachment(attachment) => file.attach(attachment),
        ExamEvent::Metadata { name, values } => file.metadata(name, values.clone()),
        ExamEvent::Damaged { .. } => Ok(()),
    }
}

pub(crate) fn written(events: &[ExamEvent]) -> Vec<u8> {
    let mut file = ExamFile::new(Vec::new(), &header()).unwrap();
    for event in events {
        put(&mut file, event).unwrap();
    }
    file.finish().unwrap().0
}

/// Everything but our own last metadata record.
pub(crate) fn read(bytes: &[u8]) -> Result<(Vec<ExamEvent>, Ending), ExamError> {
    let mut reader = ExamReader::new(bytes, "a test")?;
    let mut all = Vec::new();
    while let Some(event) = reader.next_event()? {
        if !matches!(&event, ExamEvent::Metadata { name, .. } if name == Written::NAME) {
            all.push(event);
        }
    }
    Ok((all, reader.ending().unwrap().clone()))
}

#[test]
fn what_is_recorded_is_what_is_read_to_the_bit() {
    let events = events(1200, (40, 30));
    let (back, ending) = read(&written(&events)).unwrap();
    assert_eq!(ending, Ending::Complete);
    assert!(back == events);
    // Equality of floats takes -0 for 0: the bits too.
    let bits = |all: &[ExamEvent]| format!("{all:?}");
    assert!(bits(&back) == bits(&events));
}

#[test]
fn an_exam_read_whole_has_everything_in_its_place() {
    let all = events(600, (40, 30));
    let bytes = written(&all);
    let exam = Exam::collect(ExamReader::new(bytes.as_slice(), "a test").unwrap()).unwrap();
    assert_eq!(exam.header, header());
    assert_eq!((exam.ticks.len(), exam.bscans.len(), exam.events.len()), (600, 30, 2));
    assert_eq!(exam.attachment(Attachment::PROTOCOL).unwrap().text().unwrap(), "scan(mm(200));");
    assert_eq!(exam.metadata[Written::NAME]["ticks"], "600");
    assert!(exam.damaged.is_empty() && exam.attachment("nothing").is_none());
}

#[test]
fn numbers_that_are_not_finite_are_recorded_as_they_are() {
    let mut record = tick(1, &mut Noise(1));
    record.position = Row::from_slice(&[f64::NAN, f64::INFINITY, f64::MIN_POSITIVE / 2.0]).unwrap();
    let (back, _) = read(&written(&[ExamEvent::Tick(record.clone())])).unwrap();
    let [ExamEvent::Tick(tick)] = back.as_slice() else { panic!("{back:?}") };
    let bits = |row: &Row| row.as_slice().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&tick.position), bits(&record.position));
}

#[test]
fn the_same_calls_give_the_same_bytes_on_a_thread_and_without_one() {
    let events = events(1500, (40, 30));
    let direct = written(&events);
    assert_eq!(direct, written(&events));
    for room in [0, 1, 64] {
        let sink = Shared::default();
        let writer = ExamWriter::with_room(sink.clone(), &header(), Pace::Simulated, room).unwrap();
        for event in events.clone() {
            match event {
                ExamEvent::Tick(tick) => writer.tick(tick),
                ExamEvent::BScan(placed) => writer.bscan(placed),
                ExamEvent::Event(event) => writer.event(event),
                ExamEvent::Attachment(attachment) => writer.attach(attachment),
                ExamEvent::Metadata { .. } | ExamEvent::Damaged { .. } => {}
            }
        }
        assert_eq!(writer.lost(), Lost::default());
        let counts = writer.finish().unwrap();
        assert_eq!((counts.ticks, counts.bscans, counts.attachments), (1500, 75, 3));
        assert!(sink.bytes() == direct, "room for {room}");
    }
}

#[test]
fn a_chunk_is_closed_at_least_every_second() {
    let sink = Shared::default();
    let mut file = ExamFile::new(sink.clone(), &header()).unwrap();
    let mut noise = Noise(3);
    for n in 0..2000 {
        file.tick(&tick(n, &mut noise)).unwrap();
        // Whatever happens now, what is older than a second is in the sink.
        if n % 100 == 99 {
            let (back, ending) = read(&sink.bytes()).unwrap();
            assert!(matches!(ending, Ending::Cut { .. }));
            assert!(back.len() as u64 + 500 > n, "{} of {n}", back.len());
        }
    }
}

#[test]
fn a_name_is_no_study_code_and_nothing_is_written() {
    for code in ["Jane Doe", "", "a/b", "Müller", &"x".repeat(65)] {
        let sink = Shared::default();
        let refused = ExamFile::new(sink.clone(), &ExamHeader { study_code: code.into(), ..header() });
        assert!(matches!(refused.err(), Some(ExamError::StudyCode { .. })), "{code}");
        assert!(sink.bytes().is_empty());
    }
}

#[test]
fn a_surface_whose_triangles_have_no_corners_is_refused_and_a_good_one_is_written() {
    let mut file = ExamFile::new(Vec::new(), &header()).unwrap();
    let vertices = vec![probepath_frames::Point::new(0.0, 0.0, 0.0); 3];
    let good = Surface { stamp: Stamp::ZERO, name: "lumen".into(), vertices, triangles: vec![[0, 1, 2]] };
    let bad = Surface { triangles: vec![[0, 1, 3]], ..good.clone() };
    assert!(file.surface(&bad).unwrap_err().to_string().contains("corner 3 of 3"));
    file.surface(&good).unwrap();
    let (bytes, _) = file.finish().unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!((messages.len(), messages[0].channel.topic.as_str()), (1, "/surface"));
    let scene: foxglove::messages::SceneUpdate = prost::Message::decode(messages[0].data.as_ref()).unwrap();
    assert_eq!(scene.entities[0].triangles[0].indices, [0, 1, 2]);
}

#[test]
fn a_row_of_nine_joints_is_refused() {
    assert!(matches!(Row::from_slice(&[0.0; 9]), Err(ExamError::TooManyJoints { found: 9 })));
}

#[test]
fn other_files_are_refused_with_what_they_are() {
    let error = |bytes: &[u8]| ExamReader::new(bytes, "x.mcap").err().unwrap();
    assert!(matches!(error(b""), ExamError::NoHeader { byte: 0, .. }), "{}", error(b""));
    assert!(matches!(error(b"ObjectType = Image\n"), ExamError::NotMcap { .. }));
    let mut theirs = mcap::Writer::new(io::Cursor::new(Vec::new())).unwrap();
    theirs.finish().unwrap();
    let theirs = theirs.into_inner().into_inner();
    assert!(error(&theirs).to_string().contains("no exam"), "{}", error(&theirs));
}

#[test]
fn a_newer_format_is_refused() {
    let mut values = header().to_metadata().unwrap();
    values.insert("format".into(), "2".into());
    assert!(matches!(ExamHeader::from_metadata(&values), Err(ExamError::NewerFormat { found: 2, known: 1 })));
    values.remove("format");
    assert!(matches!(ExamHeader::from_metadata(&values), Err(ExamError::Missing { field: "format" })));
}

/// Memory that the test can look into while a file is being written.
#[derive(Clone, Default)]
pub(crate) struct Shared(Arc<Mutex<Vec<u8>>>);

impl Shared {
    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.0.lock().unwrap().clone()
    }
}

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
