//! Why a pointer or a phantom's place was not found.

use thiserror::Error;

/// Touches that say too little, or contradict each other.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PointerError {
    /// Too few postures for a tip.
    #[error("{found} postures; a tip is found from {least} or more, with the ball resting in one place")]
    TooFewPostures {
        /// How many.
        found: usize,
        /// How many are needed.
        least: usize,
    },
    /// NaN or infinite.
    #[error("{what} is not finite")]
    NotFinite {
        /// Which posture or point.
        what: String,
    },
    /// Postures that turn too little for the tip to show.
    #[error(
        "the postures turn the pointer too little: its direction ({}) in the flange only swings {swing_deg:.1} degrees \
         (root mean square; {least_deg} are needed, the widest turn between two postures is {widest_deg:.1} degrees): \
         tilt the pointer by 20 degrees and more to all sides, with the ball in its place",
        three(direction)
    )]
    TurnedTooLittle {
        /// The direction that the postures leave most uncertain, in the flange.
        direction: [f64; 3],
        /// How far it swings about its mean, root mean square (degrees).
        swing_deg: f64,
        /// How far it has to.
        least_deg: f64,
        /// The widest turn between two postures (degrees).
        widest_deg: f64,
    },
    /// A ball that did not stay where it was.
    #[error(
        "the ball did not stay in one place: {found_mm:.2} mm root mean square (at most {most_mm} mm), farthest in \
         posture {worst}; {left_out} of {of} postures were left out"
    )]
    Slipped {
        /// Root mean square distance of the tip from its place (mm).
        found_mm: f64,
        /// The most that is taken.
        most_mm: f64,
        /// The posture that is farthest off, counted from one.
        worst: usize,
        /// How many were left out because they were far from the others.
        left_out: usize,
        /// Of how many.
        of: usize,
    },
    /// Fewer than three landmarks leave the phantom free to turn.
    #[error("{found} landmarks were touched; three or more, not in one line, fix where the phantom stands")]
    TooFewLandmarks {
        /// How many.
        found: usize,
    },
    /// Landmarks in one line leave the phantom free to turn about it.
    #[error(
        "the landmarks touched lie in one line ({off_mm:.1} mm off it, {least_mm} mm are needed): the phantom could be \
         turned about it; touch one that lies beside"
    )]
    InOneLine {
        /// How far they are from the line that fits them best, root mean square (mm).
        off_mm: f64,
        /// How far they have to be.
        least_mm: f64,
    },
    /// A name that is no landmark's.
    #[error("the phantom has no landmark {name:?}; there are {}", there.join(", "))]
    NoSuchLandmark {
        /// The name.
        name: String,
        /// Those that are there.
        there: Vec<String>,
    },
    /// One landmark in two entries.
    #[error("landmark {name:?} is there twice; give all its touches together")]
    TouchedTwice {
        /// The name.
        name: String,
    },
    /// More places than landmarks.
    #[error("{found} places were touched, the phantom has {there} landmarks")]
    TooManyPlaces {
        /// How many.
        found: usize,
        /// How many landmarks there are.
        there: usize,
    },
    /// A landmark without a touch.
    #[error("place {place} has no touch")]
    NoTouch {
        /// Its number, from one.
        place: usize,
    },
    /// Too many without a name to try every order.
    #[error("{unnamed} places have no landmark's name; up to {most} can be told apart, name the others")]
    TooManyUnnamed {
        /// How many.
        unnamed: usize,
        /// Up to how many are assigned.
        most: usize,
    },
    /// Two orders that fit.
    #[error(
        "the places fit the landmarks in two ways, {} ({best_mm:.2} mm) and {} ({next_mm:.2} mm): say which is which",
        best.join(", "), next.join(", ")
    )]
    Ambiguous {
        /// The landmarks of the best order.
        best: Vec<String>,
        /// Its root mean square distance (mm).
        best_mm: f64,
        /// The landmarks of the other.
        next: Vec<String>,
        /// Its root mean square distance (mm).
        next_mm: f64,
    },
    /// A mirrored system of axes.
    #[error(
        "the places touched are a mirror image of the landmarks ({mirrored_mm:.2} mm mirrored, {proper_mm:.2} mm turned): \
         one of the two is written in left-handed axes, or names are swapped"
    )]
    Mirrored {
        /// Root mean square distance with a mirror (mm).
        mirrored_mm: f64,
        /// Without (mm).
        proper_mm: f64,
    },
    /// Places that are not this phantom's.
    #[error(
        "the places touched do not fit the landmarks: {found_mm:.2} mm root mean square (at most {most_mm} mm), worst is \
         {worst:?} with {worst_mm:.2} mm; another phantom, names swapped, or a touch beside its hole"
    )]
    DoesNotFit {
        /// Root mean square distance (mm).
        found_mm: f64,
        /// The most that is taken.
        most_mm: f64,
        /// The landmark that is farthest off.
        worst: String,
        /// How far.
        worst_mm: f64,
    },
    /// No order of the places has the landmarks' distances.
    #[error(
        "no order of the places touched has the landmarks' distances within {within_mm} mm: another phantom?"
    )]
    NoOrder {
        /// How far distances may differ.
        within_mm: f64,
    },
}

fn three(direction: &[f64; 3]) -> String {
    let [x, y, z] = direction;
    format!("{x:.2}, {y:.2}, {z:.2}")
}
