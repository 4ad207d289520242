//! `fuzz/checks/dashboard.rs` on whatever the fuzzer finds.
#![no_main]

#[path = "../checks/dashboard.rs"]
mod dashboard;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| dashboard::check(bytes));
