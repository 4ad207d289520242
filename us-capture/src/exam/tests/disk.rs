//! Disks that are full, and disks that are slow.

use std::sync::mpsc::{Receiver, channel};

use super::*;

/// A disk with room for some bytes.
struct FullDisk {
    room: usize,
    disk: Shared,
}

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let fits = bytes.len().min(self.room);
        if fits == 0 && !bytes.is_empty() {
            return Err(io::Error::new(io::ErrorKind::StorageFull, "no space left on device"));
        }
        self.room -= fits;
        self.disk.write(&bytes[..fits])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error_in_words_and_what_was_recorded_is_readable() {
    let events = events(1200, (40, 30));
    let whole = written(&events).len();
    let mut most = 0;
    for room in (0..whole).step_by(whole / 60) {
        let disk = Shared::default();
        let full = FullDisk { room, disk: disk.clone() };
        let recorded = ExamFile::new(full, &header()).and_then(|mut file| {
            events.iter().try_for_each(|event| put(&mut file, event))?;
            file.finish().map(|_| ())
        });
        let error = recorded.unwrap_err();
        let message = error.to_string();
        assert!(matches!(error, ExamError::Write { .. }) && message.contains("no space left"), "{message}");
        let bytes = disk.bytes();
        assert_eq!(bytes.len(), room, "nothing is written after the error");
        if let Ok((back, _)) = read(&bytes) {
            assert_eq!(back.as_slice(), &events[..back.len()]);
            assert!(back.len() >= most);
            most = back.len();
        }
    }
    assert!(most > events.len() / 2);
}

#[test]
fn after_an_error_every_call_gives_the_same_error_and_writes_nothing() {
    let disk = Shared::default();
    let mut file = ExamFile::new(FullDisk { room: 2000, disk: disk.clone() }, &header()).unwrap();
    let mut noise = Noise(1);
    let first = (0..5000).find_map(|n| file.tick(&tick(n, &mut noise)).err()).unwrap().to_string();
    let before = disk.bytes().len();
    assert_eq!(file.tick(&tick(9, &mut noise)).unwrap_err().to_string(), first);
    assert_eq!(file.attach(&Attachment::urdf("x")).unwrap_err().to_string(), first);
    assert_eq!(file.finish().err().unwrap().to_string(), first);
    assert_eq!(disk.bytes().len(), before);
}

#[test]
fn a_writer_on_a_full_disk_says_so_and_nobody_waits_for_it() {
    for pace in [Pace::Simulated, Pace::RealTime] {
        let full = FullDisk { room: 3000, disk: Shared::default() };
        let writer = ExamWriter::with_room(full, &header(), pace, 4).unwrap();
        let mut noise = Noise(1);
        let mut n = 0;
        while writer.fault().is_none() {
            writer.tick(tick(n, &mut noise));
            n += 1;
        }
        let said = writer.fault().unwrap().to_string();
        (0..1000).for_each(|k| writer.tick(tick(n + k, &mut noise)));
        assert_eq!(writer.finish().unwrap_err().to_string(), said);
    }
}

/// A disk that writes only when told to.
struct SlowDisk {
    go: Receiver<()>,
    began: bool,
    disk: Shared,
}

impl Write for SlowDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.disk.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        // The header is flushed at once; then it waits until the test lets go (and drops its end).
        if std::mem::replace(&mut self.began, true) {
            let _ = self.go.recv();
        }
        Ok(())
    }
}

#[test]
fn in_real_time_what_finds_no_room_is_lost_counted_and_said_in_the_file() {
    let disk = Shared::default();
    let (let_go, go) = channel();
    let slow = SlowDisk { go, began: false, disk: disk.clone() };
    let writer = ExamWriter::with_room(slow, &header(), Pace::RealTime, 4).unwrap();
    let mut noise = Noise(5);
    // The first attachment makes the disk wait; of 3,000 ticks and 50 B-scans few find room meanwhile.
    writer.attach(Attachment::urdf("<robot/>"));
    for n in 0..3000 {
        writer.tick(tick(n, &mut noise));
        if n % 60 == 0 {
            writer.bscan(placed(n, (8, 8), &mut noise));
        }
    }
    let lost = writer.lost();
    assert!(lost.ticks > 2900 && lost.bscans > 40, "{lost:?}");
    drop(let_go);
    let counts = writer.finish().unwrap();
    assert_eq!(counts.ticks + lost.ticks, 3000);
    assert_eq!(counts.bscans + lost.bscans, 50);
    let bytes = disk.bytes();
    let exam = Exam::collect(ExamReader::new(bytes.as_slice(), "a test").unwrap()).unwrap();
    let said = format!("{} ticks, {} B-scans and 0 events were not recorded", lost.ticks, lost.bscans);
    assert!(exam.events.iter().any(|event| event.text.contains(&said)), "{:?}", exam.events);
}

#[test]
fn a_writer_left_by_an_error_ends_its_file() {
    let disk = Shared::default();
    let writer = ExamWriter::new(disk.clone(), &header(), Pace::Simulated).unwrap();
    let mut noise = Noise(1);
    (0..700).for_each(|n| writer.tick(tick(n, &mut noise)));
    drop(writer);
    let (back, ending) = read(&disk.bytes()).unwrap();
    assert_eq!((back.len(), ending), (700, Ending::Complete));
}

#[test]
fn a_folder_that_is_not_there_is_named() {
    let path = std::path::Path::new("no/such/folder/exam.mcap");
    let error = ExamWriter::create(path, &header(), Pace::Simulated).err().unwrap().to_string();
    assert!(error.contains("no/such/folder/exam.mcap"), "{error}");
    assert!(ExamReader::open(path).err().unwrap().to_string().contains("no/such/folder"));
}

#[test]
fn an_attachment_that_is_too_large_is_refused_and_the_rest_is_recorded() {
    let disk = Shared::default();
    let writer = ExamWriter::new(disk.clone(), &header(), Pace::Simulated).unwrap();
    let mut noise = Noise(1);
    writer.tick(tick(0, &mut noise));
    writer.attach(Attachment::report(vec![b' '; 33 << 20]));
    writer.tick(tick(1, &mut noise));
    let error = writer.finish().unwrap_err();
    assert!(matches!(&error, ExamError::TooLarge { .. }), "{error}");
    let bytes = disk.bytes();
    let exam = Exam::collect(ExamReader::new(bytes.as_slice(), "a test").unwrap()).unwrap();
    assert_eq!((exam.ticks.len(), exam.attachments.len(), exam.ending), (2, 0, Ending::Complete));
    assert!(exam.events[0].text.contains("report.html has 34603008 bytes"), "{:?}", exam.events);
}
