//! Our phantom files: a phantom that is read can be written, and is read again as it was.
#![no_main]

use libfuzzer_sys::fuzz_target;
use probepath_us_capture::phantom::WirePhantom;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(phantom) = WirePhantom::from_toml(text) {
        let again = phantom.to_toml().expect("a phantom that was read is one");
        assert_eq!(WirePhantom::from_toml(&again).expect("its text"), phantom);
    }
});
