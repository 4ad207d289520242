//! The way from the probe to the reference through the transforms that a file tracks.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use nalgebra::Matrix4;
use probepath_frames::{Pose, Probe, World};

use super::{NoChain, SkipReason};
use crate::sequence::{Sequence, SequenceImage, TransformName};

/// Which systems of a file are the probe's and the reference's, and what does not move.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainNames {
    /// Name of the probe's system in the file.
    pub probe: String,
    /// Name of the system that becomes World.
    pub reference: String,
    /// Transforms that do not change, beside those the file tracks (mm).
    pub fixed: Vec<(TransformName, Matrix4<f64>)>,
}

impl Default for ChainNames {
    /// PLUS's usual names.
    fn default() -> Self {
        Self { probe: "Probe".into(), reference: "Reference".into(), fixed: Vec::new() }
    }
}

/// One transform of the way.
#[derive(Clone, Debug)]
struct Link {
    name: TransformName,
    inverted: bool,
    /// Its matrix, when it does not change.
    fixed: Option<Matrix4<f64>>,
}

/// The transforms from the probe to the reference, in the order they are met.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    links: Vec<Link>,
}

impl Chain {
    /// The shortest way; of equal ones the first by name.
    pub(super) fn find(sequence: &Sequence, names: &ChainNames) -> Result<Self, NoChain> {
        let links = all_links(sequence, names);
        let mut came_by: BTreeMap<&str, &Link> = BTreeMap::new();
        let mut queue = VecDeque::from([names.probe.as_str()]);
        while let Some(here) = queue.pop_front() {
            for link in links.iter().filter(|l| l.ends().0 == here) {
                let there = link.ends().1;
                if there != names.probe && !came_by.contains_key(there) {
                    came_by.insert(there, link);
                    queue.push_back(there);
                }
            }
        }
        walk_back(&came_by, names).ok_or_else(|| NoChain {
            probe: names.probe.clone(),
            reference: names.reference.clone(),
            there: links.iter().filter(|l| !l.inverted).map(|l| l.name.to_string()).collect(),
        })
    }

    /// Where the probe was at this image.
    pub(super) fn pose(&self, image: &SequenceImage) -> Result<Pose<World, Probe>, SkipReason> {
        let mut reference_from_probe = Matrix4::identity();
        for link in &self.links {
            reference_from_probe = link.matrix(image)? * reference_from_probe;
        }
        reference_from_probe.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e-3);
        // The chain leads from the probe's system to the reference's, which is World for a sequence from elsewhere.
        Pose::from_matrix(&reference_from_probe).map_err(|_| SkipReason::NotRigid)
    }
}

impl Link {
    /// Where vectors come from and go, in the direction it is walked.
    fn ends(&self) -> (&str, &str) {
        let (from, to) = (self.name.from.as_str(), self.name.to.as_str());
        if self.inverted { (to, from) } else { (from, to) }
    }

    fn matrix(&self, image: &SequenceImage) -> Result<Matrix4<f64>, SkipReason> {
        let matrix = match (&self.fixed, image.transforms.get(&self.name)) {
            (Some(fixed), _) => *fixed,
            (None, None) => return Err(SkipReason::PoseMissing(self.name.to_string())),
            (None, Some(tracked)) if !tracked.status.is_usable() => {
                return Err(SkipReason::PoseInvalid(self.name.to_string()));
            }
            (None, Some(tracked)) => tracked.matrix_mm,
        };
        if self.inverted { matrix.try_inverse().ok_or(SkipReason::NotRigid) } else { Ok(matrix) }
    }
}

/// Every transform, both ways; tracked ones before fixed ones.
fn all_links(sequence: &Sequence, names: &ChainNames) -> Vec<Link> {
    let tracked: BTreeSet<&TransformName> =
        sequence.images().iter().flat_map(|i| i.transforms.keys()).collect();
    let tracked = tracked.into_iter().map(|name| (name, None));
    let fixed = names.fixed.iter().map(|(name, matrix)| (name, Some(*matrix)));
    let both = |(name, fixed): (&TransformName, Option<Matrix4<f64>>)| {
        [false, true].map(|inverted| Link { name: name.clone(), inverted, fixed })
    };
    tracked.chain(fixed).flat_map(both).collect()
}

fn walk_back(came_by: &BTreeMap<&str, &Link>, names: &ChainNames) -> Option<Chain> {
    let (mut links, mut here) = (Vec::new(), names.reference.as_str());
    while here != names.probe {
        let link = *came_by.get(here)?;
        links.push(link.clone());
        here = link.ends().0;
    }
    links.reverse();
    Some(Chain { links })
}
