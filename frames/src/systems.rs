//! The coordinate systems, each with its origin, axes, unit and what it is fixed to. All are right-handed and
//! metric (metres).

use std::fmt::Debug;

/// A coordinate system, known by its name in files, scripts and messages.
pub trait Frame: Copy + Debug + Default + PartialEq + Send + Sync + 'static {
    /// The name that travels with a pose (`NamedPose`, exam files, scripts).
    const NAME: &'static str;
}

macro_rules! system {
    ($(#[$doc:meta])* $name:ident, $text:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name;

        impl Frame for $name {
            const NAME: &'static str = $text;
        }
    };
}

system! {
    /// The table on which the patient lies supine. Origin: the table's mark, named in the cell file.
    /// Axes: the patient's LPS, that is x to the patient's left, y posterior (down, along gravity), z superior
    /// (toward the head). Fixed to the room. Surfaces and volumes are written in it, so they are LPS as they are.
    ///
    /// For a tracked sequence from elsewhere it is that file's reference system (PLUS: `Reference`).
    World, "World"
}
system! {
    /// The arm's base (the paper's R). Origin and axes: the URDF's base link, z up along the first joint's axis.
    /// Fixed to the room.
    Base, "Base"
}
system! {
    /// The arm's last link, where tools are screwed on (URDF: the chain's tip). Fixed to the last joint.
    Flange, "Flange"
}
system! {
    /// The ultrasound probe (the paper's P). Origin: the middle of the transducer's face. z: out of the face, along
    /// the beam into the tissue. x: along the array, toward the unmarked side. y = z × x: the elevation.
    /// Fixed to the probe.
    Probe, "Probe"
}
system! {
    /// A B-scan's plane (the paper's I), metric: pixels become metres through the pixel spacing. Origin: the centre
    /// of the first pixel (column 0, row 0). x: along the columns, toward the unmarked side. y: along the rows, away
    /// from the probe. z = x × y: out of the plane. Fixed to the probe for one setting of depth, focus and zoom.
    Image, "Image"
}
system! {
    /// The calibration phantom (the paper's Z). Origin and axes: as its definition file says. Fixed to the phantom.
    Phantom, "Phantom"
}
system! {
    /// The leg that is scanned. Origin: the skin over the femoral head (the inguinal landmark). Axes: parallel to
    /// the World's while the leg rests. Fixed to the femur, so it moves when the leg does.
    Leg, "Leg"
}
