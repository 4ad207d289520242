//! What can be wrong with a PLUS configuration.

use std::path::PathBuf;

use thiserror::Error;

use crate::BadPixelMap;
use crate::phantom::BadPhantom;

/// A configuration that cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlusError {
    /// The disk refused, or the file is no text.
    #[error("cannot read {path}", path = path.display())]
    Disk {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// No XML.
    #[error("not XML")]
    Xml(#[from] roxmltree::Error),
    /// XML of something else.
    #[error(
        "no transform, no VolumeReconstruction and no PhantomDefinition under <{root}>: \
         this is not a PLUS configuration with a calibration or a phantom"
    )]
    NothingHere {
        /// Its root element.
        root: String,
    },
    /// A file whose phantom was asked for.
    #[error("no PhantomDefinition under <{root}>: this file holds no phantom")]
    NoPhantom {
        /// Its root element.
        root: String,
    },
    /// A phantom that cannot be one.
    #[error("PhantomDefinition: {0}")]
    Phantom(Box<BadPhantom>),
    /// An element that has to be there.
    #[error("line {line}: there is no <{element}> in it")]
    MissingElement {
        /// Counted from one.
        line: u32,
        /// The element.
        element: &'static str,
    },
    /// An attribute that has to be there.
    #[error("line {line}: <{element}> has no {attribute}")]
    MissingAttribute {
        /// Counted from one.
        line: u32,
        /// The element.
        element: String,
        /// The attribute.
        attribute: &'static str,
    },
    /// An attribute that says nothing we know.
    #[error("line {line}: {attribute}={value:?}: {why}")]
    BadAttribute {
        /// Counted from one.
        line: u32,
        /// The attribute.
        attribute: String,
        /// Its value.
        value: String,
        /// What would be right.
        why: String,
    },
    /// A transform that was asked for.
    #[error("no transform from {from} to {to}; there are {}", there.join(", "))]
    NoTransform {
        /// Where vectors come from.
        from: String,
        /// Where they go.
        to: String,
        /// Those that are there.
        there: Vec<String>,
    },
    /// A transform that no rigid pose can hold.
    #[error("the transform from {from} to {to} is not rigid: {why}")]
    NotRigid {
        /// Where vectors come from.
        from: String,
        /// Where they go.
        to: String,
        /// What is wrong with it.
        why: String,
    },
    /// An image's transform that places no image.
    #[error("the image's transform cannot be used")]
    Pixels(#[from] BadPixelMap),
}
