//! Instants: integer nanoseconds of a named clock.

use std::fmt::{self, Debug};
use std::marker::PhantomData;
use std::ops::{Add, Sub};

/// A clock that stamps are read from.
pub trait Clock: Copy + Debug + Default + Eq + Ord + Send + Sync + 'static {
    /// The clock's name in messages.
    const NAME: &'static str;
}

macro_rules! clock {
    ($(#[$doc:meta])* $name:ident, $text:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name;

        impl Clock for $name {
            const NAME: &'static str = $text;
        }
    };
}

clock! {
    /// The exam's own clock: zero when the exam begins (a recording keeps the wall clock's offset beside it).
    /// Devices' stamps are brought to it where they enter; everything downstream speaks only of this one.
    ExamClock, "exam"
}
clock! {
    /// The arm controller's clock.
    ArmClock, "arm"
}
clock! {
    /// The ultrasound machine's clock.
    ImageClock, "image"
}
clock! {
    /// This computer's own monotone clock: when something arrived here.
    HostClock, "host"
}

/// An instant: nanoseconds since the zero of clock `C`.
///
/// Instants of two clocks have no difference:
///
/// ```compile_fail
/// # use probepath_frames::*;
/// fn lag(image: Stamp<ImageClock>, arm: Stamp<ArmClock>) -> Span {
///     image - arm
/// }
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Stamp<C = ExamClock> {
    nanoseconds: i64,
    clock: PhantomData<C>,
}

/// A signed length of time in nanoseconds; of no clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Span {
    nanoseconds: i64,
}

impl<C: Clock> Stamp<C> {
    /// The clock's zero.
    pub const ZERO: Self = Self::from_nanoseconds(0);

    /// The instant `nanoseconds` after the clock's zero.
    pub const fn from_nanoseconds(nanoseconds: i64) -> Self {
        Self { nanoseconds, clock: PhantomData }
    }

    /// Nanoseconds since the clock's zero.
    pub const fn nanoseconds(self) -> i64 {
        self.nanoseconds
    }

    /// Seconds since the clock's zero; for display and files, where a double's 53 bits are enough.
    pub fn seconds(self) -> f64 {
        self.nanoseconds as f64 * 1e-9
    }

    /// The same instant on another clock, whose zero is `offset` before this clock's zero.
    pub fn on<D: Clock>(self, offset: Span) -> Stamp<D> {
        Stamp::from_nanoseconds(self.nanoseconds.saturating_add(offset.nanoseconds))
    }
}

impl Span {
    /// No time at all.
    pub const ZERO: Self = Self::from_nanoseconds(0);

    /// A length of `nanoseconds`.
    pub const fn from_nanoseconds(nanoseconds: i64) -> Self {
        Self { nanoseconds }
    }

    /// A length of `milliseconds`.
    pub const fn from_milliseconds(milliseconds: i64) -> Self {
        Self { nanoseconds: milliseconds.saturating_mul(1_000_000) }
    }

    /// A length of `seconds`, rounded to the nanosecond. What is not finite becomes zero or the longest length.
    pub fn from_seconds(seconds: f64) -> Self {
        Self { nanoseconds: (seconds * 1e9).round() as i64 }
    }

    /// In nanoseconds.
    pub const fn nanoseconds(self) -> i64 {
        self.nanoseconds
    }

    /// In seconds.
    pub fn seconds(self) -> f64 {
        self.nanoseconds as f64 * 1e-9
    }
}

impl<C: Clock> Sub for Stamp<C> {
    type Output = Span;
    fn sub(self, earlier: Self) -> Span {
        Span::from_nanoseconds(self.nanoseconds.saturating_sub(earlier.nanoseconds))
    }
}

impl<C: Clock> Add<Span> for Stamp<C> {
    type Output = Self;
    fn add(self, span: Span) -> Self {
        Self::from_nanoseconds(self.nanoseconds.saturating_add(span.nanoseconds))
    }
}

impl<C: Clock> Sub<Span> for Stamp<C> {
    type Output = Self;
    fn sub(self, span: Span) -> Self {
        Self::from_nanoseconds(self.nanoseconds.saturating_sub(span.nanoseconds))
    }
}

impl<C: Clock> Debug for Stamp<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.9} s ({})", self.seconds(), C::NAME)
    }
}

impl<C: Clock> fmt::Display for Stamp<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.seconds())
    }
}
