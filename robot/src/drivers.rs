//! Arms on their own wire.
//!
//! ```
//! use probepath_robot::drivers::Address;
//!
//! let address: Address = "ur://192.168.1.10".parse().unwrap();
//! assert_eq!(address, Address::Ur { host: "192.168.1.10".into() });
//! ```

mod address;
pub mod ur;

pub use address::{Address, WrongAddress};
