//! The command `probepath`: it translates what was typed, and decides nothing.

fn main() {}
