//! What a record means: chunks opened, messages decoded, pictures joined to their B-scans.

use std::collections::{BTreeMap, VecDeque};

use foxglove::messages::RawImage;
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader};

use super::channels::Topic;
use super::file::RECORD_LIMIT;
use super::{decode, parse, reader};
use crate::exam::{ExamError, ExamEvent};

/// What is known of the file so far.
#[derive(Debug, Default)]
pub(crate) struct Content {
    topics: BTreeMap<u16, Option<Topic>>,
    picture: Option<RawImage>,
}

type Events = VecDeque<ExamEvent>;

impl Content {
    /// The events of one record of the file.
    pub(crate) fn record(&mut self, opcode: u8, body: &[u8], at_byte: u64, events: &mut Events) {
        let read = match opcode {
            op::CHUNK => self.chunk(body, events),
            op::ATTACHMENT => match parse::attachment(body) {
                Some(attachment) => push(events, ExamEvent::Attachment(attachment)),
                None => Err("an attachment whose checksum or length is wrong".into()),
            },
            op::METADATA => match parse::metadata(body) {
                Some((name, values)) => push(events, ExamEvent::Metadata { name, values }),
                None => Err("a metadata record whose checksum is wrong or missing".into()),
            },
            _ => Ok(()),
        };
        if let Err(why) = read {
            events.push_back(ExamEvent::Damaged { at_byte, why });
        }
    }

    /// A whole chunk or, when its checksum is wrong, nothing of it.
    fn chunk(&mut self, body: &[u8], events: &mut Events) -> Result<(), String> {
        let header = parse::chunk(body).ok_or("a chunk whose lengths are wrong")?;
        // Only what we write is opened: the reader's path for bare chunks subtracts lengths that it does not check.
        if header.compression != "zstd" || header.checksum == 0 {
            return Err(format!("a chunk compressed with {:?}, or without a checksum", header.compression));
        }
        if header.uncompressed_bytes > RECORD_LIMIT as u64 {
            return Err(format!("a chunk that claims {} bytes", header.uncompressed_bytes));
        }
        let options = reader::options().with_skip_start_magic(true).with_skip_end_magic(true);
        let mut chunk = LinearReader::new_with_options(options);
        let mut rest: &[&[u8]] = &[&[op::CHUNK], &(body.len() as u64).to_le_bytes(), body];
        while let Some(event) = chunk.next_event() {
            match event.map_err(|error| error.to_string())? {
                LinearReadEvent::Record { data, opcode } => self.in_chunk(opcode, data, events)?,
                LinearReadEvent::ReadRequest(_) => {
                    let next = rest.first().copied().unwrap_or_default();
                    rest = rest.get(1..).unwrap_or_default();
                    chunk.insert(next.len()).copy_from_slice(next);
                    chunk.notify_read(next.len());
                }
            }
        }
        Ok(())
    }

    fn in_chunk(&mut self, opcode: u8, body: &[u8], events: &mut Events) -> Result<(), String> {
        match opcode {
            op::CHANNEL => {
                let (id, topic) = parse::channel(body).ok_or("a channel that is not protobuf")?;
                self.topics.insert(id, Topic::of(topic));
                Ok(())
            }
            op::MESSAGE => {
                let message = parse::message(body).ok_or("a message cut short")?;
                self.message(&message, events).map_err(|error| error.to_string())
            }
            _ => Ok(()),
        }
    }

    fn message(&mut self, message: &parse::Message<'_>, events: &mut Events) -> Result<(), ExamError> {
        // Undeclared: the chunk that declares it was damaged.
        let topic =
            self.topics.get(&message.channel).copied().unwrap_or_else(|| Topic::by_id(message.channel));
        match topic {
            Some(Topic::Tick) => events.push_back(ExamEvent::Tick(decode::tick(message.data)?)),
            Some(Topic::Image) => self.picture = Some(decode::raw_image(message.data)?),
            Some(Topic::BScan) => {
                let placed = decode::bscan(message.data, self.picture.take())?;
                events.push_back(ExamEvent::BScan(placed));
            }
            Some(Topic::Events) => {
                events.push_back(ExamEvent::Event(decode::event(message.data, message.log_time)?));
            }
            // What viewers show is a copy of what the ticks hold exactly, and of what can be made again.
            Some(
                Topic::Transform
                | Topic::ImageTransform
                | Topic::JointStates
                | Topic::JointCommands
                | Topic::Wrench
                | Topic::Surface,
            )
            | None => {}
        }
        Ok(())
    }
}

#[expect(clippy::unnecessary_wraps, reason = "the arms of a match have one type")]
fn push(events: &mut Events, event: ExamEvent) -> Result<(), String> {
    events.push_back(event);
    Ok(())
}
