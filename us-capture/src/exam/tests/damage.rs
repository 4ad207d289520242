//! Files cut short and files with flipped bits.

use super::*;

/// Where each record of the file ends, found by walking opcodes and lengths: an independent road to what is whole.
fn record_ends(bytes: &[u8]) -> Vec<(u8, usize)> {
    let mut ends = Vec::new();
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 9) {
        at += 9 + usize::try_from(u64::from_le_bytes(head[1..].try_into().unwrap())).unwrap();
        ends.push((head[0], at));
    }
    ends
}

#[test]
fn a_file_cut_at_every_kilobyte_gives_every_whole_chunk_before_the_cut() {
    let events = events(1500, (64, 48));
    let bytes = written(&events);
    let ends = record_ends(&bytes);
    let mut cuts: Vec<usize> = (0..bytes.len()).step_by(1024).collect();
    // And around the end of every record, where an off-by-one would hide.
    cuts.extend(ends.iter().flat_map(|(_, end)| [end - 1, *end, end + 1]).filter(|cut| *cut < bytes.len()));
    cuts.sort_unstable();
    let mut counts = Vec::new();
    for cut in cuts {
        let whole = ends.iter().rev().find(|(_, end)| *end <= cut);
        // The header and the exam's own metadata are the first two records.
        if cut < ends[1].1 {
            let error = ExamReader::new(&bytes[..cut], "cut").err().unwrap();
            assert!(matches!(error, ExamError::NoHeader { .. }), "{cut}: {error}");
            continue;
        }
        let (back, ending) = read(&bytes[..cut]).unwrap();
        assert_eq!(back.as_slice(), &events[..back.len()], "cut at {cut}");
        let whole = whole.unwrap().1 as u64;
        assert_eq!(ending, Ending::Cut { whole_until_byte: whole, bytes: cut as u64 });
        counts.push((whole, back.len()));
    }
    counts.dedup();
    assert!(counts.is_sorted_by(|a, b| a.0 < b.0 && a.1 <= b.1), "what is whole decides what is read");
    // Each chunk that became whole brought something: nothing waits for a later one.
    let chunks: Vec<u64> =
        ends.iter().filter(|(opcode, _)| *opcode == 6).map(|(_, end)| *end as u64).collect();
    assert!(chunks.len() >= 3, "{} chunks in {} bytes", chunks.len(), bytes.len());
    for chunk in chunks {
        let at = counts.iter().position(|(whole, _)| *whole == chunk).unwrap();
        assert!(counts[at].1 > counts[at - 1].1);
    }
    assert_eq!(counts.last().unwrap().1, events.len());
}

/// Everything read from a damaged file was recorded just so, in that order.
fn is_part_of(part: &[ExamEvent], whole: &[ExamEvent]) -> bool {
    let mut rest = whole.iter();
    part.iter().all(|event| matches!(event, ExamEvent::Damaged { .. }) || rest.any(|other| other == event))
}

#[test]
fn thousands_of_damaged_files_end_in_words_and_never_in_other_numbers() {
    let events = events(160, (24, 16));
    let bytes = written(&events);
    let mut noise = Noise(11);
    let (mut refused, mut damaged, mut ended) = (0, 0, 0);
    for round in 0..8000 {
        let mut bad = bytes.clone();
        // One flipped bit, a run of noise, bytes taken out, or a length made huge.
        let at = (noise.next() % bad.len() as u64) as usize;
        match round % 4 {
            0 => bad[at] ^= 1 << (noise.next() % 8),
            1 => bad[at..].iter_mut().take(40).for_each(|byte| *byte = noise.next() as u8),
            2 => drop(bad.drain(at..(at + 1 + (noise.next() % 9) as usize).min(bytes.len()))),
            _ => bad[at..].iter_mut().take(8).for_each(|byte| *byte = 0xFF),
        }
        match read(&bad) {
            Err(_) => refused += 1,
            Ok((back, ending)) => {
                assert!(is_part_of(&back, &events), "round {round}, byte {at}");
                damaged += u32::from(back.iter().any(|event| matches!(event, ExamEvent::Damaged { .. })));
                ended += u32::from(ending != Ending::Complete);
            }
        }
    }
    assert!(refused > 20 && damaged > 500 && ended > 500, "{refused} {damaged} {ended}");
}

#[test]
fn a_damaged_chunk_is_named_and_all_the_others_are_read() {
    let events = events(1500, (24, 16));
    let bytes = written(&events);
    let ends = record_ends(&bytes);
    let chunks: Vec<usize> = (1..ends.len()).filter(|i| ends[*i].0 == 6).collect();
    assert!(chunks.len() >= 3);
    // The first one declares the channels: losing it costs what it holds, and no more.
    let mut lost = 0;
    for chunk in chunks {
        let (start, end) = (ends[chunk - 1].1, ends[chunk].1);
        let mut bad = bytes.clone();
        bad[usize::midpoint(start, end)] ^= 0x10;
        let (back, ending) = read(&bad).unwrap();
        let (named, whole): (Vec<_>, Vec<_>) =
            back.into_iter().partition(|event| matches!(event, ExamEvent::Damaged { .. }));
        let [ExamEvent::Damaged { at_byte, .. }] = named.as_slice() else { panic!("{named:?}") };
        assert_eq!(*at_byte, start as u64);
        assert!(is_part_of(&whole, &events));
        lost += events.len() - whole.len();
        assert!(matches!(ending, Ending::Damaged { .. }), "{ending:?}");
    }
    let attachments = 3;
    assert_eq!(lost, events.len() - attachments, "together the chunks hold everything, each once");
}

#[test]
fn messages_of_noise_are_refused_in_words() {
    let mut noise = Noise(17);
    let tick = encode::tick(&tick(3, &mut noise));
    let scan = placed(4, (8, 8), &mut noise);
    let (bscan, image) = (encode::bscan(&scan), encode::raw_image(&scan.bscan));
    let whole = [prost::Message::encode_to_vec(&tick), prost::Message::encode_to_vec(&bscan)];
    let mut refused = 0;
    for round in 0..20_000 {
        let mut bytes = whole[round % 2].clone();
        for _ in 0..=noise.next() % 4 {
            let at = (noise.next() % bytes.len() as u64) as usize;
            bytes[at] = noise.next() as u8;
        }
        bytes.truncate((noise.next() % (2 * bytes.len() as u64)) as usize);
        let read = [
            decode::tick(&bytes).map(|_| ()),
            decode::bscan(&bytes, Some(image.clone())).map(|_| ()),
            decode::raw_image(&bytes).map(|_| ()),
            decode::event(&bytes, 0).map(|_| ()),
        ];
        refused += read.iter().filter(|read| read.is_err()).count();
    }
    assert!(refused > 20_000, "{refused}");
}

#[test]
fn a_length_made_huge_takes_no_memory() {
    let bytes = written(&events(200, (24, 16)));
    for (_, end) in record_ends(&bytes) {
        let Some(length) = bytes.get(end + 1..end + 9) else { continue };
        assert_ne!(length, u64::MAX.to_le_bytes());
        for value in [u64::MAX.to_le_bytes(), (1u64 << 40).to_le_bytes(), (60u64 << 20).to_le_bytes()] {
            let mut bad = bytes.clone();
            bad[end + 1..end + 9].copy_from_slice(&value);
            // A limit on the length of every record is what refuses it: an allocation of a terabyte would abort.
            if let Ok((_, ending)) = read(&bad) {
                assert_ne!(ending, Ending::Complete);
            }
        }
    }
}
