//! The phantoms that ship with the project.

/// Name and file.
const SHIPPED: [(&str, &str); 5] = [
    ("fcal-1.0", include_str!("../../phantoms/fcal-1.0.toml")),
    ("fcal-1.2", include_str!("../../phantoms/fcal-1.2.toml")),
    ("fcal-2.0", include_str!("../../phantoms/fcal-2.0.toml")),
    ("ical-3n", include_str!("../../phantoms/ical-3n.toml")),
    ("z-19", include_str!("../../phantoms/z-19.toml")),
];

pub(super) fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

pub(super) fn text(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text)
}
