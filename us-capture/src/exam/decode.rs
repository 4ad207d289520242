//! From the messages of the file to plain values, each checked.

use std::borrow::Cow;

use foxglove::messages::{Log, RawImage};
use probepath_frames::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Frame, Pose, Probe, Span, Stamp, Wrench};
use prost::Message;

use super::proto;
use crate::exam::{Event, ExamError, Level, Row, TickRecord};
use crate::{BScan, PixelSpacing, PlacedBScan, Setting};

/// How far a quaternion's length may be from one. Products of rotations drift by rounding only, and are kept to the
/// bit, so that what was recorded is what is read.
const UNIT_WITHIN: f64 = 1e-9;

pub(crate) fn tick(data: &[u8]) -> Result<TickRecord, ExamError> {
    let message: proto::Tick = message(data, "a tick")?;
    let what = || format!("tick {}", message.tick);
    let wrench = message.wrench.as_ref().ok_or_else(|| bad(what(), "it has no wrench"))?;
    Ok(TickRecord {
        tick: message.tick,
        stamp: Stamp::from_nanoseconds(message.stamp_ns),
        command: if message.stay || message.freedrive {
            None
        } else {
            Some(Row::from_slice(&message.command)?)
        },
        position: Row::from_slice(&message.position)?,
        velocity: Row::from_slice(&message.velocity)?,
        commanded: Row::from_slice(&message.commanded)?,
        wrench: read_wrench(wrench, &what)?,
        guiding: message.guiding,
        phase: Cow::Owned(message.phase.clone()),
        world_from_probe: message.world_from_probe.as_ref().map(|pose| read_pose(pose, &what)).transpose()?,
        safety: Cow::Owned(message.safety.clone()),
        freedrive: message.freedrive,
        age: Span::from_nanoseconds(message.age_ns),
        overtaken: message.overtaken,
    })
}

/// The B-scan of a `probepath.BScan` and the picture that came just before it.
pub(crate) fn bscan(data: &[u8], picture: Option<RawImage>) -> Result<PlacedBScan, ExamError> {
    let message: proto::BScan = message(data, "a B-scan")?;
    let what = || format!("B-scan {}", message.number);
    let picture = picture.ok_or_else(|| bad(what(), "its picture is missing"))?;
    if (picture.width, picture.height) != (message.width, message.height) || picture.encoding != "mono8" {
        return Err(bad(what(), "the picture before it is of another size or not mono8"));
    }
    let stamps = (Stamp::from_nanoseconds(message.formed_ns), Stamp::from_nanoseconds(message.arrived_ns));
    let size = (message.width as usize, message.height as usize);
    let bscan = BScan::new(message.number, stamps, setting(&message), size, picture.data.as_ref())
        .map_err(|error| bad(what(), &error.to_string()))?;
    let missing = || bad(what(), "it has no pose");
    Ok(PlacedBScan {
        bscan,
        world_from_probe: read_pose(message.world_from_probe.as_ref().ok_or_else(missing)?, &what)?,
        world_from_image: read_pose(message.world_from_image.as_ref().ok_or_else(missing)?, &what)?,
        wrench: message.wrench.as_ref().map(|wrench| read_wrench(wrench, &what)).transpose()?,
    })
}

fn setting(message: &proto::BScan) -> Setting {
    Setting {
        depth_m: message.depth_m,
        focus_m: message.focus_m,
        window_top_m: message.window_top_m,
        window_height_m: message.window_height_m,
        window_width_m: message.window_width_m,
        spacing: PixelSpacing { x_m: message.spacing_x_m, y_m: message.spacing_y_m },
    }
}

pub(crate) fn raw_image(data: &[u8]) -> Result<RawImage, ExamError> {
    message(data, "a picture")
}

pub(crate) fn event(data: &[u8], log_time: u64) -> Result<Event, ExamError> {
    use foxglove::messages::log;
    let message: Log = message(data, "an event")?;
    let level = match log::Level::try_from(message.level) {
        Ok(log::Level::Warning) => Level::Warning,
        Ok(log::Level::Error | log::Level::Fatal) => Level::Error,
        _ => Level::Info,
    };
    let stamp = Stamp::from_nanoseconds(i64::try_from(log_time).unwrap_or(i64::MAX));
    Ok(Event { stamp, level, source: message.name, text: message.message })
}

fn message<M: Message + Default>(data: &[u8], what: &str) -> Result<M, ExamError> {
    M::decode(data).map_err(|error| bad(what.into(), &error.to_string()))
}

fn read_wrench(wrench: &proto::Wrench, what: &impl Fn() -> String) -> Result<Wrench<Probe>, ExamError> {
    if wrench.written_in != Probe::NAME {
        return Err(bad(
            what(),
            &format!("its wrench is written in {:?} instead of Probe", wrench.written_in),
        ));
    }
    Ok(Wrench::new(
        Vector3::new(wrench.force_x_n, wrench.force_y_n, wrench.force_z_n),
        Vector3::new(wrench.torque_x_nm, wrench.torque_y_nm, wrench.torque_z_nm),
    ))
}

fn read_pose<A: Frame, B: Frame>(
    pose: &proto::Pose,
    what: &impl Fn() -> String,
) -> Result<Pose<A, B>, ExamError> {
    if pose.written_in != A::NAME || pose.of != B::NAME {
        let found =
            format!("its pose is {}_T_{} instead of {}_T_{}", pose.written_in, pose.of, A::NAME, B::NAME);
        return Err(bad(what(), &found));
    }
    let quaternion = Quaternion::new(pose.qw, pose.qx, pose.qy, pose.qz);
    let length = quaternion.norm();
    // Written so that NaN is refused too.
    if !((length - 1.0).abs() <= UNIT_WITHIN && [pose.x_m, pose.y_m, pose.z_m].iter().all(|x| x.is_finite()))
    {
        return Err(bad(what(), &format!("its pose has a quaternion of length {length}, or is not finite")));
    }
    let translation = Translation3::new(pose.x_m, pose.y_m, pose.z_m);
    // FRAMES: both names were just compared with those of A and B.
    Ok(Pose::assume(Isometry3::from_parts(translation, UnitQuaternion::new_unchecked(quaternion))))
}

fn bad(what: String, why: &str) -> ExamError {
    ExamError::BadRecord { what, why: why.into() }
}
