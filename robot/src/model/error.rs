//! What can be wrong with a URDF, and what is only worth saying.

use std::fmt;

use thiserror::Error;

use crate::MAX_JOINTS;

/// Why a URDF gave no [`Model`](crate::Model). Each names the file, the place in it, and what to do.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ModelError {
    /// The file could not be read.
    #[error("{file}: cannot be read ({why}); check the path and that the file is text in UTF-8")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system said.
        why: String,
    },
    /// The text is not a URDF.
    #[error(
        "{file}: this is not a URDF ({why}); a URDF is XML whose root is <robot>, expanded from xacro first"
    )]
    NotUrdf {
        /// The file.
        file: String,
        /// What the reader said.
        why: String,
    },
    /// A link was asked for that the file does not have.
    #[error("{file}: there is no link \"{link}\"; the links are: {}", exist.join(", "))]
    NoSuchLink {
        /// The file.
        file: String,
        /// The link asked for.
        link: String,
        /// The links that exist.
        exist: Vec<String>,
    },
    /// Two links, or two joints, have the same name.
    #[error("{file}: two {what}s are named \"{name}\"; give each a name of its own")]
    Duplicate {
        /// The file.
        file: String,
        /// `link` or `joint`.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A joint names a link that the file does not have.
    #[error(
        "{file}: joint \"{joint}\": its {field} link \"{link}\" is not in the file; add the link or correct the name"
    )]
    UnknownLink {
        /// The file.
        file: String,
        /// The joint.
        joint: String,
        /// `parent` or `child`.
        field: &'static str,
        /// The link that is missing.
        link: String,
    },
    /// A link is the child of two joints.
    #[error(
        "{file}: link \"{link}\" is the child of both \"{first}\" and \"{second}\"; a closed chain is not supported: remove one"
    )]
    TwoParents {
        /// The file.
        file: String,
        /// The link.
        link: String,
        /// One joint.
        first: String,
        /// The other joint.
        second: String,
    },
    /// Following the joints upward comes back to the same link.
    #[error(
        "{file}: joint \"{joint}\": link \"{link}\" is its own ancestor; a loop is not supported: correct the parents"
    )]
    Loop {
        /// The file.
        file: String,
        /// A joint of the loop.
        joint: String,
        /// A link of the loop.
        link: String,
    },
    /// The two links are in separate trees.
    #[error("{file}: no joints lead from \"{base}\" to \"{tip}\"; \"{tip}\" hangs from \"{root}\"")]
    NoChain {
        /// The file.
        file: String,
        /// The base link.
        base: String,
        /// The tip link.
        tip: String,
        /// The root of the tip's tree.
        root: String,
    },
    /// Nothing moves between the two links.
    #[error(
        "{file}: no joint between \"{base}\" and \"{tip}\" moves; choose links with a moving joint between them"
    )]
    NoJoints {
        /// The file.
        file: String,
        /// The base link.
        base: String,
        /// The tip link.
        tip: String,
    },
    /// More joints than [`MAX_JOINTS`].
    #[error(
        "{file}: {found} joints move between \"{base}\" and \"{tip}\" and at most {MAX_JOINTS} are supported; choose a shorter chain"
    )]
    TooManyJoints {
        /// The file.
        file: String,
        /// The base link.
        base: String,
        /// The tip link.
        tip: String,
        /// How many there are.
        found: usize,
    },
    /// A kind of joint that no serial arm has.
    #[error(
        "{file}: joint \"{joint}\": type \"{kind}\" is not supported between base and tip; make it revolute, continuous, prismatic or fixed"
    )]
    NotSupported {
        /// The file.
        file: String,
        /// The joint.
        joint: String,
        /// Its type.
        kind: &'static str,
    },
    /// A number that cannot be.
    #[error("{file}: joint \"{joint}\": {field} is {value}; {fix}")]
    Number {
        /// The file.
        file: String,
        /// The joint.
        joint: String,
        /// Which number.
        field: &'static str,
        /// What it is.
        value: Value,
        /// What to do.
        fix: &'static str,
    },
    /// A mimic joint that cannot be followed.
    #[error("{file}: joint \"{joint}\": it mimics \"{master}\", {why}")]
    Mimic {
        /// The file.
        file: String,
        /// The mimic joint.
        joint: String,
        /// Its master.
        master: String,
        /// What is wrong and what to do.
        why: &'static str,
    },
}

/// One number, or three, as the file has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// One number.
    One(f64),
    /// A range.
    Range(f64, f64),
    /// A vector.
    Three([f64; 3]),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::One(x) => write!(f, "{x}"),
            Self::Range(lower, upper) => write!(f, "{lower} to {upper}"),
            Self::Three([x, y, z]) => write!(f, "\"{x} {y} {z}\""),
        }
    }
}

/// What a URDF has that the model can do without. Shown to a person once; the model is good.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ModelWarning {
    /// A mesh that is not where the file says.
    MissingMesh {
        /// The link that shows it.
        link: String,
        /// As the file names it.
        mesh: String,
        /// What to do.
        why: String,
    },
    /// A joint off the chain, of a kind that is not supported: it is left out.
    JointLeftOut {
        /// The joint.
        joint: String,
        /// Its type.
        kind: &'static str,
    },
}

impl fmt::Display for ModelWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MissingMesh { link, mesh, why } => write!(f, "link \"{link}\": mesh \"{mesh}\" {why}"),
            Self::JointLeftOut { joint, kind } => {
                write!(
                    f,
                    "joint \"{joint}\": type \"{kind}\" is not supported; it is off the chain and left out"
                )
            }
        }
    }
}
