//! The floors of the house: a crate leans only downward, as `ARCHITECTURE.md` draws it.

use std::collections::BTreeMap;

use cargo_metadata::{DependencyKind, MetadataCommand, Package};

/// Which rooms each room may lean on. A new room, or a new edge, is a decision that is made here and in
/// `ARCHITECTURE.md` together.
const MAY_LEAN_ON: &[(&str, &[&str])] = &[
    ("probepath-frames", &[]),
    ("probepath-robot", &["probepath-frames"]),
    ("probepath-us-capture", &["probepath-frames"]),
    ("probepath-teach-replay", &["probepath-frames", "probepath-robot"]),
    ("probepath-recon", &["probepath-frames", "probepath-us-capture"]),
    ("probepath-sim", &["probepath-frames", "probepath-robot", "probepath-us-capture"]),
    (
        "probepath-scripts",
        &[
            "probepath-frames",
            "probepath-robot",
            "probepath-us-capture",
            "probepath-teach-replay",
            "probepath-recon",
            "probepath-sim",
        ],
    ),
    ("probepath", &["probepath-scripts"]),
];

/// Every edge of `package` that goes up or sideways, in words. Development dependencies count: a test that leans
/// upward has left its room. Only the root's tests see the house whole.
fn wrong_edges(package: &Package, allowed: &BTreeMap<&str, &[&str]>) -> Vec<String> {
    let Some(may) = allowed.get(package.name.as_str()) else {
        return vec![format!("{} has no floor: add it to MAY_LEAN_ON and ARCHITECTURE.md", package.name)];
    };
    let root = package.name.as_str() == "probepath";
    package
        .dependencies
        .iter()
        .filter(|d| d.name.starts_with("probepath") && !may.contains(&d.name.as_str()))
        .filter(|d| !(root && d.kind == DependencyKind::Development))
        .map(|d| format!("{} leans on {}, which is not below it", package.name, d.name))
        .collect()
}

#[test]
fn no_crate_leans_up_or_sideways() {
    let metadata = MetadataCommand::new().no_deps().exec().expect("cargo metadata");
    let allowed: BTreeMap<_, _> = MAY_LEAN_ON.iter().copied().collect();
    let members = metadata.workspace_packages();
    assert_eq!(members.len(), allowed.len(), "every room has its floor");
    let wrong: Vec<String> = members.iter().flat_map(|p| wrong_edges(p, &allowed)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn an_edge_that_goes_up_is_named() {
    let metadata = MetadataCommand::new().no_deps().exec().expect("cargo metadata");
    let members = metadata.workspace_packages();
    let scripts = members.iter().find(|p| p.name.as_str() == "probepath-scripts").expect("scripts");
    let pretended: BTreeMap<&str, &[&str]> = [("probepath-scripts", &["probepath-frames"] as &[&str])].into();
    let wrong = wrong_edges(scripts, &pretended);
    assert!(
        wrong.iter().any(|w| w == "probepath-scripts leans on probepath-sim, which is not below it"),
        "{wrong:?}"
    );
}
