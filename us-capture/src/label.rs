//! Labels: which wire made which dot.

use probepath_frames::{Image, Phantom, Pose};

use crate::dots::Dot;

/// The wires that made the dots of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Labels {
    /// For every wire of the phantom, in its order, the dot it made; `None` where it made none that was found.
    pub dots: Vec<Option<Dot>>,
    /// Where the image's plane lies in the phantom by these dots alone.
    pub phantom_from_image: Pose<Phantom, Image>,
    /// Root mean square distance of the dots from their wires with that pose (m).
    pub rms_m: f64,
}
