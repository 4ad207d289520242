//! Configurations of PLUS, and everything that one can be asked for.
#![no_main]

use libfuzzer_sys::fuzz_target;
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::plus::PlusConfig;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(phantom) = WirePhantom::from_plus_xml(text) {
        let again = phantom.to_toml().expect("a phantom that was read is one");
        assert_eq!(WirePhantom::from_toml(&again).expect("its text"), phantom);
    }
    if let Ok(config) = PlusConfig::parse(text) {
        if let Ok(Some(placed)) = config.world_from_phantom() {
            assert!(placed.is_finite());
        }
        drop(config.pixels_in_probe(&config.frames.image, &config.frames.probe));
    }
});
