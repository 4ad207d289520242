//! Stored calibrations: one that is read can be written and is read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use probepath_us_capture::Calibration;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(calibration) = Calibration::from_toml(text) {
        let again = calibration.to_toml().expect("a calibration that was read is one");
        Calibration::from_toml(&again).expect("its text");
    }
});
