//! MCAP records from bytes that may be damaged: every length is checked against what is there.
//!
//! The crate's own `parse_record` indexes past the end of an attachment whose length was damaged, and panics.
//! Source: the MCAP specification, sections "Records" and "Serialization".

use std::collections::BTreeMap;

/// Bytes, read from the front.
pub(crate) struct Bytes<'a>(pub(crate) &'a [u8]);

impl<'a> Bytes<'a> {
    pub(crate) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(crate) fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.take(usize::try_from(length).ok()?)?).ok()
    }

    fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let length = self.u32()?;
        let mut pairs = Bytes(self.take(usize::try_from(length).ok()?)?);
        let mut map = BTreeMap::new();
        while !pairs.0.is_empty() {
            map.insert(pairs.text()?.to_owned(), pairs.text()?.to_owned());
        }
        Some(map)
    }
}

/// The profile of a Header record.
pub(crate) fn profile(body: &[u8]) -> Option<&str> {
    Bytes(body).text()
}

/// Id and topic of a Channel record whose messages are protobuf.
pub(crate) fn channel(body: &[u8]) -> Option<(u16, &str)> {
    let mut bytes = Bytes(body);
    let (id, _schema) = (bytes.u16()?, bytes.u16()?);
    let (topic, encoding) = (bytes.text()?, bytes.text()?);
    (encoding == "protobuf").then_some((id, topic))
}

/// A Message record.
pub(crate) struct Message<'a> {
    pub(crate) channel: u16,
    pub(crate) log_time: u64,
    pub(crate) data: &'a [u8],
}

pub(crate) fn message(body: &[u8]) -> Option<Message<'_>> {
    let mut bytes = Bytes(body);
    let (channel, _sequence) = (bytes.u16()?, bytes.u32()?);
    let (log_time, _publish_time) = (bytes.u64()?, bytes.u64()?);
    Some(Message { channel, log_time, data: bytes.0 })
}

/// A Metadata record: name and values, their checksum compared and taken out.
pub(crate) fn metadata(body: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    let mut bytes = Bytes(body);
    let (name, mut values) = (bytes.text()?.to_owned(), bytes.map()?);
    let saved = values.remove(CHECKSUM)?;
    (saved == metadata_checksum(&name, &values)).then_some((name, values))
}

/// Name of the value that holds a metadata record's checksum: MCAP has one for chunks and attachments, but none for
/// metadata, and a study code with a flipped bit is another study.
pub(crate) const CHECKSUM: &str = "checksum";

/// CRC-32 of a metadata record's name and values, each ended by a zero byte; hexadecimal.
pub(crate) fn metadata_checksum(name: &str, values: &BTreeMap<String, String>) -> String {
    let mut checksum = flate2::Crc::new();
    let texts = values.iter().flat_map(|(key, value)| [key.as_str(), value.as_str()]);
    for text in std::iter::once(name).chain(texts) {
        checksum.update(text.as_bytes());
        checksum.update(&[0]);
    }
    format!("{:08x}", checksum.sum())
}

/// An Attachment record, its checksum compared.
pub(crate) fn attachment(body: &[u8]) -> Option<crate::exam::Attachment> {
    let (covered, saved) = body.split_at_checked(body.len().checked_sub(4)?)?;
    let mut checksum = flate2::Crc::new();
    checksum.update(covered);
    if Bytes(saved).u32()? != checksum.sum() {
        return None;
    }
    let mut bytes = Bytes(covered);
    let (_log_time, _create_time) = (bytes.u64()?, bytes.u64()?);
    let (name, media_type) = (bytes.text()?, bytes.text()?);
    let length = usize::try_from(bytes.u64()?).ok()?;
    Some(crate::exam::Attachment::new(name, media_type, bytes.take(length)?))
}

/// A Chunk record's header: what it decompresses to, and how it is compressed.
pub(crate) struct ChunkHeader<'a> {
    pub(crate) uncompressed_bytes: u64,
    pub(crate) checksum: u32,
    pub(crate) compression: &'a str,
}

pub(crate) fn chunk(body: &[u8]) -> Option<ChunkHeader<'_>> {
    let mut bytes = Bytes(body);
    let (_first, _last) = (bytes.u64()?, bytes.u64()?);
    let (uncompressed_bytes, checksum) = (bytes.u64()?, bytes.u32()?);
    let compression = bytes.text()?;
    let compressed = usize::try_from(bytes.u64()?).ok()?;
    bytes.take(compressed)?;
    Some(ChunkHeader { uncompressed_bytes, checksum, compression })
}
