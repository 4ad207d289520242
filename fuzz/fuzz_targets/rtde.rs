//! `fuzz/checks/rtde.rs` on whatever the fuzzer finds.
#![no_main]

#[path = "../checks/rtde.rs"]
mod rtde;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| rtde::check(bytes));
