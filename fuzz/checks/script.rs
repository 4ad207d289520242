//! The scripts that a controller is sent: any bytes are recognised as something, and what is read from our own text is
//! what another text of it says.

use probepath_robot::drivers::ur::script::Parameters;
use probepath_sim::controller::recognise;

/// Panics where it does not hold.
pub fn check(bytes: &[u8]) {
    let _ = recognise(bytes);
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Some(read) = Parameters::read(text) {
        assert_eq!(Parameters::read(&read.text()), Some(read));
    }
}
