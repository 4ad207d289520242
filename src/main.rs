//! The command `probepath`.

fn main() {}
