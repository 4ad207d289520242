#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at the first surprise")]

use std::io::Write;
use std::net::{TcpListener, TcpStream};

use probepath_frames::{Span, Stamp};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::clock::Dating;
use super::encode::message;
use super::reader::Numbers;
use super::*;
use crate::{BScanSource, PixelSpacing, Setting, SourceFault};

fn image(columns: u16, rows: u16, seed: u64) -> Image {
    let mut pixels = vec![0; usize::from(columns) * usize::from(rows)];
    ChaCha8Rng::seed_from_u64(seed).fill_bytes(&mut pixels);
    Image { columns, rows, spacing_mm: [0.0625, 0.125], pixels }
}

/// Everything that a decoder finds in bytes that come in pieces.
fn decode(bytes: &[u8], mut piece: impl FnMut() -> usize) -> Result<Vec<Message>, IgtlError> {
    let (mut decoder, mut messages, mut rest) = (Decoder::default(), Vec::new(), bytes);
    while !rest.is_empty() {
        let (mut now, later) = rest.split_at(piece().clamp(1, rest.len()));
        rest = later;
        while !now.is_empty() {
            messages.extend(decoder.feed(&mut now)?);
        }
    }
    Ok(messages)
}

fn pictures(messages: &[Message]) -> Vec<(u32, i64, Image)> {
    let picture = |message: &Message| match message {
        Message::Image(header, image) => Some((header.id, header.stamp.nanoseconds(), image.clone())),
        Message::Other(_) => None,
    };
    messages.iter().filter_map(picture).collect()
}

/// Three pictures, with other messages between them.
fn stream() -> (Vec<u8>, Vec<(u32, i64, Image)>) {
    let (mut bytes, mut sent) = (Vec::new(), Vec::new());
    for n in 1..4_u32 {
        let (stamp, image) = (1_000_000_007 * i64::from(n), image(7 * n as u16, 5, u64::from(n)));
        bytes.extend(message(1, "TRANSFORM", "Tracker", 5, &[7; 48]).unwrap());
        bytes.extend(encode_image("Probe", n, stamp, &image).unwrap());
        bytes.extend(encode_status("Probe", stamp).unwrap());
        sent.push((n, stamp, image));
    }
    (bytes, sent)
}

#[test]
fn every_split_of_the_bytes_gives_the_same_pictures() {
    let (bytes, sent) = stream();
    for at in 1..bytes.len() {
        let mut pieces = [at, bytes.len()].into_iter();
        let messages = decode(&bytes, || pieces.next().unwrap()).unwrap();
        assert_eq!((messages.len(), pictures(&messages)), (9, sent.clone()));
    }
    let mut dice = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..300 {
        let messages = decode(&bytes, || dice.random_range(1..80)).unwrap();
        assert_eq!(pictures(&messages), sent);
    }
}

#[test]
fn a_stream_cut_at_every_byte_gives_what_was_whole() {
    let (bytes, sent) = stream();
    for end in 0..bytes.len() {
        let found = pictures(&decode(&bytes[..end], || 4096).unwrap());
        assert_eq!(found[..], sent[..found.len()]);
    }
}

#[test]
fn a_flipped_bit_is_never_a_picture() {
    let (bytes, _) = stream();
    let first = bytes.len() / 3;
    let mut refused = 0;
    for bit in 0..8 * first {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let Ok(messages) = decode(&damaged, || 4096) else {
            refused += 1;
            continue;
        };
        // Names, stamps and versions have no checksum of their own; the pictures have.
        for (_, _, image) in pictures(&messages) {
            assert!(stream().1.iter().any(|(.., sent)| *sent == image), "bit {bit}");
        }
    }
    assert!(refused > 8 * 50, "only {refused} damages were noticed");
}

#[test]
fn no_bytes_make_it_panic() {
    let mut dice = ChaCha8Rng::seed_from_u64(2);
    let (whole, _) = stream();
    for round in 0..20_000 {
        let mut bytes = vec![0; dice.random_range(0..400)];
        dice.fill_bytes(&mut bytes);
        if round % 2 == 0 {
            bytes = whole.clone();
            for _ in 0..dice.random_range(1..6) {
                let at = dice.random_range(0..bytes.len());
                bytes[at] = dice.random();
            }
        }
        drop(decode(&bytes, || 97));
    }
    // Bodies with a right checksum and any content at all.
    for _ in 0..20_000 {
        let mut body = vec![0; dice.random_range(0..120)];
        dice.fill_bytes(&mut body);
        if dice.random() {
            body.splice(0..body.len().min(6), [0, 1, 1, 3, 2, 2]);
        }
        let version = dice.random_range(1..4);
        drop(decode(&message(version, "IMAGE", "Any", 0, &body).unwrap(), || 97));
    }
}

#[test]
fn what_is_no_openigtlink_is_refused_in_words() {
    let refused = |bytes: &[u8]| decode(bytes, || 4096).unwrap_err().to_string();
    let http = refused(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\nServer: something\r\n\r\n");
    assert!(http.contains("HTTP/1.1") && http.contains("OpenIGTLink server?"), "{http}");
    let mut long = message(1, "IMAGE", "Probe", 0, &[]).unwrap();
    long[42..50].copy_from_slice(&u64::MAX.to_be_bytes());
    assert!(refused(&long).contains("claims 18446744073709551615 bytes"), "{}", refused(&long));
    for claim in [0_u64, 3, 65535] {
        let mut odd = message(1, "IMAGE", "Probe", 0, &[0; 200]).unwrap();
        odd[42..50].copy_from_slice(&claim.to_be_bytes());
        let decoded = decode(&odd, || 4096);
        assert!(decoded.is_err() || decoded.unwrap().is_empty(), "{claim}");
    }
    let short = message(2, "IMAGE", "Probe", 0, &[0, 12, 255, 255, 255, 255, 255, 255, 0, 0, 0, 1]).unwrap();
    assert!(refused(&short).contains("claim 4295032842"), "{}", refused(&short));
}

#[test]
fn what_is_no_bscan_says_what_it_has_to_be() {
    let whole = encode_image("Probe", 1, 0, &image(4, 3, 1)).unwrap();
    let content = &whole[HEADER_BYTES + 12..whole.len() - 2];
    let changed = |at: usize, to: u8| {
        let mut content = content.to_vec();
        content[at] = to;
        decode(&message(1, "IMAGE", "Probe", 0, &content).unwrap(), || 4096)
    };
    assert_eq!(pictures(&changed(0, 0).unwrap())[0].2, image(4, 3, 1));
    let cases = [
        (2, 3, "1 component"),
        (3, 5, "8-bit grey"),
        (7, 0, "send columns x rows x 1"),
        (11, 2, "send columns x rows x 1"),
        (67, 2, "send whole pictures"),
        (61, 1, "send whole pictures"),
        (9, 4, "send whole pictures"),
        (13, 0xff, "a spacing is more than zero"),
    ];
    for (at, to, wanted) in cases {
        let mut found = changed(at, to);
        if at == 13 {
            // Not a number, in the first axis.
            let mut content = content.to_vec();
            content[12..16].copy_from_slice(&f32::NAN.to_be_bytes());
            found = decode(&message(1, "IMAGE", "Probe", 0, &content).unwrap(), || 4096);
        }
        let words = found.unwrap_err().to_string();
        assert!(words.contains(wanted) && words.contains("\"Probe\""), "byte {at}: {words}");
    }
    let words = decode(&message(1, "IMAGE", "P", 0, &content[..80]).unwrap(), || 9).unwrap_err().to_string();
    assert!(words.contains("need 12 bytes, 8 came"), "{words}");
}

#[test]
fn numbers_keep_the_gaps_and_go_on_after_a_machine_begins_anew() {
    let mut numbers = Numbers::default();
    let given: Vec<u64> = [5, 6, 9, 1, 2, 4, 0, 0, 9].map(|id| numbers.next(id)).into();
    assert_eq!(given, [5, 6, 9, 10, 11, 13, 14, 15, 18]);
}

#[test]
fn a_clock_of_its_own_is_brought_to_the_arms() {
    let mut dating = Dating::new(MachineClock::Own);
    let mut dice = ChaCha8Rng::seed_from_u64(3);
    let ms = 1_000_000_i64;
    let mut worst = 0;
    for n in 0..2000_i64 {
        // The arm's clock is 40 s ahead of this computer's, the machine's is the years since 1970; pictures take 30 to
        // 50 ms, states 1 to 5.
        let host = 33 * ms * n;
        let state = dice.random_range(ms..5 * ms);
        dating.tick(Stamp::from_nanoseconds(host + 40_000 * ms - state), Stamp::from_nanoseconds(host));
        let formed = host - dice.random_range(30 * ms..50 * ms);
        let stamp = Stamp::from_nanoseconds(formed + 1_700_000_000_000 * ms);
        let now = Stamp::from_nanoseconds(host + 40_000 * ms - state + 2 * ms);
        let (dated, arrived) = dating.of(stamp, Stamp::from_nanoseconds(host), now).unwrap();
        assert!(dated <= arrived);
        if n > 500 {
            // What is left is constant: the least picture delay less the least state delay, 29 ms.
            let truth = formed + 40_000 * ms + 29 * ms;
            worst = worst.max((dated.nanoseconds() - truth).abs());
        }
    }
    assert!(worst < ms, "off by {worst} ns");
}

#[test]
fn a_stamp_of_another_clock_is_refused() {
    let mut dating = Dating::new(MachineClock::OfArm);
    let now = Stamp::from_nanoseconds(60_000_000_000);
    dating.tick(now, Stamp::ZERO);
    let epoch = Stamp::from_nanoseconds(1_700_000_000_000_000_000);
    let why = dating.of(epoch, Stamp::ZERO, now).unwrap_err();
    assert!(why.contains("two clocks"), "{why}");
    let (formed, _) = dating.of(Stamp::from_nanoseconds(59_990_000_000), Stamp::ZERO, now).unwrap();
    assert_eq!(formed.nanoseconds(), 59_990_000_000);
}

fn settings(listener: &TcpListener, wait: Wait) -> IgtlSettings {
    let address = listener.local_addr().unwrap();
    IgtlSettings {
        host: address.ip().to_string(),
        port: address.port(),
        device: Some("Probe".into()),
        setting: Setting {
            depth_m: 0.07,
            focus_m: 0.045,
            window_top_m: 0.0,
            window_height_m: 5.0 * 0.125e-3,
            window_width_m: 7.0 * 0.0625e-3,
            spacing: PixelSpacing { x_m: 0.0625e-3, y_m: 0.125e-3 },
        },
        clock: MachineClock::OfArm,
        wait,
    }
}

/// Sends pictures 1 to `count` at 1 ms each, and a mark after each.
fn send(socket: &mut TcpStream, count: u32) {
    for n in 1..=count {
        let stamp = 1_000_000 * i64::from(n);
        socket.write_all(&encode_image("Probe", n, stamp, &image(7, 5, u64::from(n))).unwrap()).unwrap();
        socket.write_all(&encode_status("Probe", stamp).unwrap()).unwrap();
    }
}

fn ms(ms: i64) -> Stamp {
    Stamp::ZERO + Span::from_milliseconds(ms)
}

#[test]
fn in_simulated_time_a_poll_finds_what_had_arrived_and_nothing_else() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let wanted = settings(&listener, Wait::ForMarks).setting;
    let mut source = IgtlSource::connect(settings(&listener, Wait::ForMarks)).unwrap();
    let (mut socket, _) = listener.accept().unwrap();
    // More than the queue has room for: the sender waits, nothing is lost.
    let sending = std::thread::spawn(move || send(&mut socket, 500));
    for n in 1..=100 {
        let bscan = source.poll(ms(n)).unwrap().unwrap();
        assert_eq!((bscan.number, bscan.formed, bscan.arrived), (n as u64, ms(n), ms(n)));
        assert_eq!(bscan.pixels(), image(7, 5, n as u64).pixels);
        assert_eq!(bscan.setting, wanted);
        assert_eq!(source.poll(ms(n)).unwrap(), None);
    }
    source.skip(ms(300)).unwrap();
    let bscan = source.poll(ms(301)).unwrap().unwrap();
    assert_eq!(bscan.number, 301, "those before were skipped");
    sending.join().unwrap();
}

#[test]
fn a_lost_connection_is_made_again_and_a_gap_shows() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut source = IgtlSource::connect(settings(&listener, Wait::ForMarks)).unwrap();
    let (mut socket, _) = listener.accept().unwrap();
    send(&mut socket, 2);
    socket.write_all(&encode_image("Probe", 3, 3_000_000, &image(7, 5, 3)).unwrap()[..90]).unwrap();
    assert_eq!(source.poll(ms(1)).unwrap().unwrap().number, 1);
    drop(socket);
    let (mut socket, _) = listener.accept().unwrap();
    socket.write_all(&encode_image("Probe", 5, 5_000_000, &image(7, 5, 5)).unwrap()).unwrap();
    socket.write_all(&encode_status("Probe", 5_000_000).unwrap()).unwrap();
    let numbers: Vec<u64> = std::iter::from_fn(|| source.poll(ms(5)).unwrap()).map(|b| b.number).collect();
    assert_eq!(numbers, [2, 5]);
    assert_eq!(source.counts(), IgtlCounts { received: 3, lost_connections: 1, ..IgtlCounts::default() });
}

#[test]
fn a_server_of_something_else_is_a_fault_in_words() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut source = IgtlSource::connect(settings(&listener, Wait::ForMarks)).unwrap();
    let (mut socket, _) = listener.accept().unwrap();
    socket.write_all(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\nServer: something\r\n\r\n").unwrap();
    let fault = source.poll(ms(1)).unwrap_err();
    assert!(matches!(&fault, SourceFault::Unreadable { why, .. } if why.contains("HTTP")), "{fault}");
    drop(source);
    let address = listener.local_addr().unwrap();
    drop(listener);
    let gone = IgtlSettings { host: address.ip().to_string(), port: address.port(), ..settings_of_nobody() };
    assert!(matches!(IgtlSource::connect(gone).unwrap_err(), SourceFault::Unreachable { .. }));
}

fn settings_of_nobody() -> IgtlSettings {
    settings(&TcpListener::bind("127.0.0.1:0").unwrap(), Wait::Never)
}
