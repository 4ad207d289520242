//! `fuzz/checks/igtl.rs` on whatever the fuzzer finds.
#![no_main]

#[path = "../checks/igtl.rs"]
mod igtl;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| igtl::check(bytes));
