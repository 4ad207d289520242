//! Stamps as sequence files print them: seconds with a decimal point, read and written without passing through a
//! double, so that nanoseconds of the Unix epoch survive.

use probepath_frames::Stamp;

/// The instant of a text like `345.627957` or `1.7e9`; `None` when it is none.
pub(super) fn parse(text: &str) -> Option<Stamp> {
    let text = text.trim();
    let (negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    if !digits.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        return None;
    }
    let nanoseconds = plain(digits).or_else(|| from_double(digits))?;
    i64::try_from(if negative { -nanoseconds } else { nanoseconds }).ok().map(Stamp::from_nanoseconds)
}

/// `whole.fraction`, both of digits only; what is below a nanosecond is cut.
fn plain(digits: &str) -> Option<i128> {
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() || !all_digits(whole) || !all_digits(fraction) {
        return None;
    }
    let nine: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    whole.parse::<i128>().ok()?.checked_mul(1_000_000_000)?.checked_add(nine.parse().ok()?)
}

fn from_double(text: &str) -> Option<i128> {
    let seconds: f64 = text.parse().ok()?;
    (0.0..9.0e9).contains(&seconds).then(|| (seconds * 1e9).round() as i128)
}

/// Seconds with at least six digits behind the point, as many as the nanoseconds need.
pub(super) fn text(stamp: Stamp) -> String {
    let nanoseconds = stamp.nanoseconds();
    let (whole, rest) =
        (nanoseconds.unsigned_abs() / 1_000_000_000, nanoseconds.unsigned_abs() % 1_000_000_000);
    let sign = if nanoseconds < 0 { "-" } else { "" };
    let full = format!("{sign}{whole}.{rest:09}");
    full.strip_suffix("000").map_or(full.clone(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_of_the_unix_epoch_keeps_its_nanoseconds() {
        let stamp = parse("1700000000.123456789").expect("a stamp");
        assert_eq!(stamp.nanoseconds(), 1_700_000_000_123_456_789);
        assert_eq!(text(stamp), "1700000000.123456789");
    }

    #[test]
    fn stamps_come_as_they_are_printed() {
        for (printed, nanoseconds) in [
            ("000.0", 0),
            ("345.627957", 345_627_957_000),
            ("-0.5", -500_000_000),
            ("1.5e-3", 1_500_000),
            ("7", 7_000_000_000),
        ] {
            assert_eq!(parse(printed).map(Stamp::nanoseconds), Some(nanoseconds), "{printed}");
        }
        for wrong in ["", "nan", "inf", "1.2.3", "-", "--1", "--0", "-+5", "1e99", "99999999999999999999"] {
            assert_eq!(parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn what_is_printed_is_read_back() {
        for nanoseconds in [0, 1, -1, 345_627_957_000, -1_500_000_000, i64::MAX, i64::MIN, 1_000] {
            let stamp = Stamp::from_nanoseconds(nanoseconds);
            assert_eq!(parse(&text(stamp)), Some(stamp));
        }
    }
}
