//! Typed quantities for protocols: `mm(120)`, `newton(5)`, `mm_s(10)`. A bare number is never a length.

use std::fmt;

use rhai::{Dynamic, Engine, EvalAltResult, FLOAT, INT};

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $kind:literal, $example:literal, $unit:literal, $per_unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
        pub struct $name(f64);

        impl $name {
            /// The quantity of an SI value.
            pub const fn from_si(value: f64) -> Self {
                Self(value)
            }

            /// The SI value.
            pub const fn si(self) -> f64 {
                self.0
            }
        }

        impl Quantity for $name {
            const KIND: &'static str = $kind;
            const EXAMPLE: &'static str = $example;
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{} {}", round(self.0 / $per_unit), $unit)
            }
        }
    };
}

/// A quantity that a protocol can name.
pub trait Quantity: Copy + fmt::Display + Send + Sync + 'static {
    /// What it is, with its article: "a length".
    const KIND: &'static str;
    /// How one is written: "mm(120)".
    const EXAMPLE: &'static str;
}

quantity! {
    /// A length (m inside).
    Length, "a length", "mm(120)", "mm", 1e-3
}
quantity! {
    /// A force (N inside).
    Force, "a force", "newton(5)", "N", 1.0
}
quantity! {
    /// A speed (m/s inside).
    Speed, "a speed", "mm_s(10)", "mm/s", 1e-3
}
quantity! {
    /// An angle (rad inside).
    Angle, "an angle", "degrees(15)", "degrees", 0.017453292519943295
}
quantity! {
    /// A length of time (s inside).
    Duration, "a length of time", "seconds(2)", "s", 1.0
}

quantity! {
    /// A temperature (degrees Celsius inside).
    Temperature, "a temperature", "celsius(20)", "degrees Celsius", 1.0
}

/// Nine digits are more than any protocol measures, and hide the last bits of a conversion.
fn round(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// Registers the constructors, the arithmetic and the texts of every quantity.
pub fn register(engine: &mut Engine) {
    family::<Length>(engine, "Length", &[("mm", 1e-3), ("cm", 1e-2), ("metres", 1.0)], Length, Length::si);
    family::<Force>(engine, "Force", &[("newton", 1.0)], Force, Force::si);
    family::<Speed>(engine, "Speed", &[("mm_s", 1e-3), ("cm_s", 1e-2)], Speed, Speed::si);
    let degree = 1f64.to_radians();
    family::<Angle>(engine, "Angle", &[("degrees", degree), ("radians", 1.0)], Angle, Angle::si);
    family::<Temperature>(engine, "Temperature", &[("celsius", 1.0)], Temperature, Temperature::si);
    family::<Duration>(engine, "Duration", &[("seconds", 1.0), ("minutes", 60.0)], Duration, Duration::si);
}

fn family<Q: Quantity + PartialOrd>(
    engine: &mut Engine,
    name: &str,
    units: &[(&str, f64)],
    make: fn(f64) -> Q,
    si: fn(Q) -> f64,
) {
    engine.register_type_with_name::<Q>(name);
    for &(unit, size) in units {
        engine.register_fn(unit, move |x: FLOAT| make(x * size));
        engine.register_fn(unit, move |x: INT| make(x as f64 * size));
    }
    engine.register_fn("to_string", |q: &mut Q| q.to_string());
    engine.register_fn("to_debug", |q: &mut Q| q.to_string());
    engine.register_fn("+", move |a: Q, b: Q| make(si(a) + si(b)));
    engine.register_fn("-", move |a: Q, b: Q| make(si(a) - si(b)));
    engine.register_fn("-", move |a: Q| make(-si(a)));
    engine.register_fn("*", move |a: Q, x: FLOAT| make(si(a) * x));
    engine.register_fn("*", move |a: Q, x: INT| make(si(a) * x as f64));
    engine.register_fn("*", move |x: FLOAT, a: Q| make(si(a) * x));
    engine.register_fn("*", move |x: INT, a: Q| make(si(a) * x as f64));
    engine.register_fn("/", move |a: Q, x: FLOAT| make(si(a) / x));
    engine.register_fn("/", move |a: Q, x: INT| make(si(a) / x as f64));
    engine.register_fn("/", move |a: Q, b: Q| si(a) / si(b));
    incomparable::<Q>(engine);
    engine.register_fn("<", |a: Q, b: Q| a < b);
    engine.register_fn("<=", |a: Q, b: Q| a <= b);
    engine.register_fn(">", |a: Q, b: Q| a > b);
    engine.register_fn(">=", |a: Q, b: Q| a >= b);
    engine.register_fn("==", |a: Q, b: Q| a == b);
    engine.register_fn("!=", |a: Q, b: Q| a != b);
}

/// Rhai takes a comparison of two types that nobody defined for false; here it is an error.
fn incomparable<Q: Quantity>(engine: &mut Engine) {
    fn refused<Q: Quantity>(quantity: Q, other: &Dynamic) -> Result<bool, Box<EvalAltResult>> {
        Err(format!(
            "{quantity} cannot be compared with {}: give both a unit of the same kind",
            describe(other)
        )
        .into())
    }
    for operator in ["<", "<=", ">", ">=", "==", "!="] {
        engine.register_fn(operator, |a: Q, b: Dynamic| refused(a, &b));
        engine.register_fn(operator, |a: Dynamic, b: Q| refused(b, &a));
    }
}

/// A value as a message shows it: a quantity with its unit, a bare number as what it is.
pub fn describe(value: &Dynamic) -> String {
    fn shown<Q: Quantity>(value: &Dynamic) -> Option<String> {
        value.read_lock::<Q>().map(|quantity| format!("`{}`", *quantity))
    }
    if value.is_int() || value.is_float() {
        return format!("{value}, a bare number without a unit");
    }
    shown::<Length>(value)
        .or_else(|| shown::<Force>(value))
        .or_else(|| shown::<Speed>(value))
        .or_else(|| shown::<Angle>(value))
        .or_else(|| shown::<Duration>(value))
        .or_else(|| shown::<Temperature>(value))
        .unwrap_or_else(|| format!("`{value}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn engine() -> Engine {
        let mut engine = Engine::new();
        register(&mut engine);
        engine
    }

    #[test]
    fn units_are_converted_once() {
        let length: Length = engine().eval("mm(120) + cm(3) / 2").unwrap();
        assert!((length.si() - 0.135).abs() < 1e-15);
        assert_eq!(length.to_string(), "135 mm");
    }

    #[test]
    fn a_force_is_not_a_length() {
        let error = engine().eval::<Length>("mm(1) + newton(1)").unwrap_err();
        assert!(error.to_string().contains("line 1, position 7"), "{error}");
    }

    #[test]
    fn a_bare_number_is_not_a_length() {
        for comparison in ["mm(5) > 4", "4.0 < mm(5)", "mm(5) == newton(5)", "mm(5) != 5"] {
            let error = engine().eval::<bool>(comparison).unwrap_err().to_string();
            assert!(error.contains("cannot be compared"), "{comparison}: {error}");
        }
        assert!(engine().eval::<bool>("mm(5) > mm(4)").unwrap());
    }
}
