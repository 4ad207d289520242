//! From plain values to the messages of the file.

use foxglove::messages::{
    Color, FrameTransform, JointState, JointStates, Log, Point3, Quaternion, RawImage, SceneEntity,
    SceneUpdate, Timestamp, TriangleListPrimitive, Vector3, log,
};
use probepath_frames::nalgebra::Isometry3;
use probepath_frames::{Frame, Point, Pose, Probe, Stamp, World, Wrench};

use super::proto;
use crate::exam::{Event, Level, Row, Surface, TickRecord};
use crate::{BScan, PlacedBScan};

/// A stamp as Foxglove has it; what lies before the exam's zero becomes zero (our own messages keep it).
pub(crate) fn timestamp(stamp: Stamp) -> Timestamp {
    let nanoseconds = stamp.nanoseconds().max(0).unsigned_abs();
    let seconds = u32::try_from(nanoseconds / 1_000_000_000).unwrap_or(u32::MAX);
    Timestamp::new_checked(seconds, (nanoseconds % 1_000_000_000) as u32).unwrap_or(Timestamp::MAX)
}

pub(crate) fn transform<A: Frame, B: Frame>(stamp: Stamp, pose: &Pose<A, B>) -> FrameTransform {
    let Isometry3 { rotation, translation } = pose.isometry();
    FrameTransform {
        timestamp: Some(timestamp(stamp)),
        parent_frame_id: A::NAME.into(),
        child_frame_id: B::NAME.into(),
        translation: Some(Vector3 { x: translation.x, y: translation.y, z: translation.z }),
        rotation: Some(Quaternion { x: rotation.i, y: rotation.j, z: rotation.k, w: rotation.w }),
    }
}

pub(crate) fn joint_states(
    names: &[String],
    stamp: Stamp,
    position: &Row,
    velocity: Option<&Row>,
) -> JointStates {
    let joint = |(i, position): (usize, &f64)| JointState {
        name: names.get(i).cloned().unwrap_or_else(|| format!("joint_{i}")),
        position: Some(*position),
        velocity: velocity.and_then(|row| row.as_slice().get(i).copied()),
        acceleration: None,
        effort: None,
    };
    let joints = position.as_slice().iter().enumerate().map(joint).collect();
    JointStates { timestamp: Some(timestamp(stamp)), joints }
}

pub(crate) fn log(event: &Event) -> Log {
    let level = match event.level {
        Level::Info => log::Level::Info,
        Level::Warning => log::Level::Warning,
        Level::Error => log::Level::Error,
    };
    Log {
        timestamp: Some(timestamp(event.stamp)),
        level: level.into(),
        message: event.text.clone(),
        name: event.source.clone(),
        file: String::new(),
        line: 0,
    }
}

/// A red, slightly transparent entity of triangles in the World.
pub(crate) fn scene(surface: &Surface) -> SceneUpdate {
    let point = |p: &Point<World>| Point3 { x: p.vector().x, y: p.vector().y, z: p.vector().z };
    let triangles = TriangleListPrimitive {
        pose: Some(foxglove::messages::Pose {
            position: Some(Vector3::default()),
            orientation: Some(Quaternion { w: 1.0, ..Quaternion::default() }),
        }),
        points: surface.vertices.iter().map(point).collect(),
        color: Some(Color { r: 0.8, g: 0.15, b: 0.1, a: 0.8 }),
        colors: Vec::new(),
        indices: surface.triangles.iter().flatten().copied().collect(),
    };
    let entity = SceneEntity {
        timestamp: Some(timestamp(surface.stamp)),
        frame_id: World::NAME.into(),
        id: surface.name.clone(),
        frame_locked: true,
        triangles: vec![triangles],
        ..SceneEntity::default()
    };
    SceneUpdate { deletions: Vec::new(), entities: vec![entity] }
}

pub(crate) fn raw_image(bscan: &BScan) -> RawImage {
    RawImage {
        timestamp: Some(timestamp(bscan.formed)),
        frame_id: "Image".into(),
        width: bscan.width() as u32,
        height: bscan.height() as u32,
        encoding: "mono8".into(),
        step: bscan.width() as u32,
        data: bscan.pixels().to_vec().into(),
    }
}

pub(crate) fn bscan(placed: &PlacedBScan) -> proto::BScan {
    let (bscan, setting) = (&placed.bscan, &placed.bscan.setting);
    proto::BScan {
        number: bscan.number,
        formed_ns: bscan.formed.nanoseconds(),
        arrived_ns: bscan.arrived.nanoseconds(),
        depth_m: setting.depth_m,
        focus_m: setting.focus_m,
        window_top_m: setting.window_top_m,
        window_height_m: setting.window_height_m,
        window_width_m: setting.window_width_m,
        spacing_x_m: setting.spacing.x_m,
        spacing_y_m: setting.spacing.y_m,
        width: bscan.width() as u32,
        height: bscan.height() as u32,
        world_from_probe: Some(pose(&placed.world_from_probe)),
        world_from_image: Some(pose(&placed.world_from_image)),
        wrench: placed.wrench.as_ref().map(wrench),
    }
}

pub(crate) fn tick(record: &TickRecord) -> proto::Tick {
    let numbers = |row: &Row| row.as_slice().to_vec();
    proto::Tick {
        tick: record.tick,
        stamp_ns: record.stamp.nanoseconds(),
        stay: record.command.is_none() && !record.freedrive,
        command: record.command.as_ref().map(numbers).unwrap_or_default(),
        position: numbers(&record.position),
        velocity: numbers(&record.velocity),
        commanded: numbers(&record.commanded),
        wrench: Some(wrench(&record.wrench)),
        guiding: record.guiding,
        phase: record.phase.clone().into_owned(),
        world_from_probe: record.world_from_probe.as_ref().map(pose),
        safety: record.safety.clone().into_owned(),
        freedrive: record.freedrive,
        age_ns: record.age.nanoseconds(),
        overtaken: record.overtaken,
    }
}

pub(crate) fn wrench(wrench: &Wrench<Probe>) -> proto::Wrench {
    let (force, torque) = (wrench.force, wrench.torque);
    proto::Wrench {
        written_in: Probe::NAME.into(),
        force_x_n: force.x,
        force_y_n: force.y,
        force_z_n: force.z,
        torque_x_nm: torque.x,
        torque_y_nm: torque.y,
        torque_z_nm: torque.z,
    }
}

fn pose<A: Frame, B: Frame>(pose: &Pose<A, B>) -> proto::Pose {
    let Isometry3 { rotation, translation } = pose.isometry();
    proto::Pose {
        written_in: A::NAME.into(),
        of: B::NAME.into(),
        x_m: translation.x,
        y_m: translation.y,
        z_m: translation.z,
        qx: rotation.i,
        qy: rotation.j,
        qz: rotation.k,
        qw: rotation.w,
    }
}
