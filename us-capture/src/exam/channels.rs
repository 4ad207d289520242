//! The topics of an exam file, declared in the file when first used.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use foxglove::Encode;
use foxglove::messages::{FrameTransform, JointStates, Log, RawImage};
use mcap::McapResult;

use super::schema;

/// A topic, with what its messages are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Topic {
    Tick,
    BScan,
    Image,
    Transform,
    JointStates,
    JointCommands,
    Wrench,
    Events,
}

const TOPICS: [Topic; 8] = [
    Topic::Tick,
    Topic::BScan,
    Topic::Image,
    Topic::Transform,
    Topic::JointStates,
    Topic::JointCommands,
    Topic::Wrench,
    Topic::Events,
];

impl Topic {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Tick => "/tick",
            Self::BScan => "/bscan",
            Self::Image => "/bscan/image",
            Self::Transform => "/tf",
            Self::JointStates => "/joint_states",
            Self::JointCommands => "/joint_commands",
            Self::Wrench => "/wrench",
            Self::Events => "/events",
        }
    }

    pub(crate) fn of(name: &str) -> Option<Self> {
        TOPICS.into_iter().find(|topic| topic.name() == name)
    }

    /// Name and descriptors of its messages.
    fn schema(self) -> (String, Vec<u8>) {
        let own = |name: &str| (format!("probepath.{name}"), schema::descriptor_set());
        match self {
            Self::Tick => own("Tick"),
            Self::BScan => own("BScan"),
            Self::Wrench => own("Wrench"),
            Self::Image => foxglove_schema::<RawImage>(),
            Self::Transform => foxglove_schema::<FrameTransform>(),
            Self::JointStates | Self::JointCommands => foxglove_schema::<JointStates>(),
            Self::Events => foxglove_schema::<Log>(),
        }
    }
}

fn foxglove_schema<M: Encode>() -> (String, Vec<u8>) {
    M::get_schema().map(|schema| (schema.name, schema.data.into_owned())).unwrap_or_default()
}

/// Which topics a file has declared, and how many messages each has.
#[derive(Debug, Default)]
pub(crate) struct Channels {
    known: [Option<(u16, u32)>; TOPICS.len()],
}

impl Channels {
    /// The channel of a topic and the next sequence number in it, declaring it first when it is new.
    pub(crate) fn next<W: Write + Seek>(
        &mut self,
        topic: Topic,
        mcap: &mut mcap::Writer<W>,
    ) -> McapResult<(u16, u32)> {
        let Some(slot) = self.known.get_mut(topic as usize) else { return Ok((0, 0)) };
        let (id, sequence) = match *slot {
            Some(known) => known,
            None => (declare(topic, mcap)?, 0),
        };
        *slot = Some((id, sequence.wrapping_add(1)));
        Ok((id, sequence))
    }
}

fn declare<W: Write + Seek>(topic: Topic, mcap: &mut mcap::Writer<W>) -> McapResult<u16> {
    let (name, descriptors) = topic.schema();
    let schema = mcap.add_schema(&name, "protobuf", &descriptors)?;
    mcap.add_channel(schema, topic.name(), "protobuf", &BTreeMap::new())
}
