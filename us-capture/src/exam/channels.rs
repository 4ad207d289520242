//! The topics of an exam file, declared in the file when first used.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use foxglove::Encode;
use foxglove::messages::{FrameTransform, JointStates, Log, RawImage, SceneUpdate};
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
    Surface,
    ImageTransform,
}

const TOPICS: [Topic; 10] = [
    Topic::Tick,
    Topic::BScan,
    Topic::Image,
    Topic::Transform,
    Topic::JointStates,
    Topic::JointCommands,
    Topic::Wrench,
    Topic::Events,
    Topic::Surface,
    Topic::ImageTransform,
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
            Self::Surface => "/surface",
            Self::ImageTransform => "/bscan/tf",
        }
    }

    /// Its channel's and schema's id in every file of format 1: a reader knows the topic even where the chunk that
    /// declares it is damaged.
    pub(crate) const fn id(self) -> u16 {
        self as u16 + 1
    }

    pub(crate) fn by_id(id: u16) -> Option<Self> {
        TOPICS.into_iter().find(|topic| topic.id() == id)
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
            Self::Transform | Self::ImageTransform => foxglove_schema::<FrameTransform>(),
            Self::JointStates | Self::JointCommands => foxglove_schema::<JointStates>(),
            Self::Events => foxglove_schema::<Log>(),
            Self::Surface => foxglove_schema::<SceneUpdate>(),
        }
    }
}

fn foxglove_schema<M: Encode>() -> (String, Vec<u8>) {
    M::get_schema().map(|schema| (schema.name, schema.data.into_owned())).unwrap_or_default()
}

/// How many messages each topic has; none before it is declared.
#[derive(Debug, Default)]
pub(crate) struct Channels {
    messages: BTreeMap<u16, u32>,
}

impl Channels {
    /// The next sequence number of a topic, declaring it first when it is new.
    pub(crate) fn next<W: Write + Seek>(
        &mut self,
        topic: Topic,
        mcap: &mut mcap::Writer<W>,
    ) -> McapResult<u32> {
        if let Some(count) = self.messages.get_mut(&topic.id()) {
            *count = count.wrapping_add(1);
            return Ok(*count);
        }
        declare(topic, mcap)?;
        self.messages.insert(topic.id(), 0);
        Ok(0)
    }
}

fn declare<W: Write + Seek>(topic: Topic, mcap: &mut mcap::Writer<W>) -> McapResult<u16> {
    let (name, descriptors) = topic.schema();
    let schema = mcap.add_schema_with_id(topic.id(), &name, "protobuf", &descriptors)?;
    mcap.add_channel_with_id(topic.id(), schema, topic.name(), "protobuf", &BTreeMap::new())
}
