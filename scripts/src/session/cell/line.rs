//! What is wrong with a field of a cell file, and on which line it stands.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What is wrong with a field.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wrong {
    /// The field with the tables around it: `arm.payload_kg`.
    field: String,
    /// What it is, and what it has to be.
    why: String,
}

impl Wrong {
    pub(super) fn new(field: impl Into<String>, why: impl Into<String>) -> Self {
        Self { field: field.into(), why: why.into() }
    }

    /// In words, with the line of the file's text where the field stands; where the field is missing, the line of the
    /// table that should have it.
    pub(super) fn told(&self, text: &str) -> String {
        let Self { field, why } = self;
        line_of(text, field)
            .map_or_else(|| format!("{field} {why}"), |line| format!("line {line}: {field} {why}"))
    }
}

/// A number within bounds, or what is wrong with it; `bounds` ends in the unit.
pub(super) fn within(field: &str, value: f64, (low, high): (f64, f64), unit: &str) -> Result<(), Wrong> {
    // Written so that NaN is refused as well.
    if value >= low && value <= high {
        return Ok(());
    }
    Err(Wrong::new(field, format!("is {value}; it has to be between {low} and {high} {unit}")))
}

/// A number above zero.
pub(super) fn positive(field: &str, value: f64) -> Result<(), Wrong> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Wrong::new(field, format!("is {value}; it must be positive and finite")))
}

/// The line, counted from one, of a field or of the innermost table around it that is there.
pub(super) fn line_of(text: &str, field: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let (mut table, mut at) = (document.get_ref(), None);
    for name in field.split('.') {
        let Some((key, value)) = table.iter().find(|(key, _)| key.get_ref().as_ref() == name) else { break };
        at = Some(start(key.span().start, value));
        let Some(inner) = value.get_ref().as_table() else { break };
        table = inner;
    }
    let before = text.get(..at?)?;
    Some(before.matches('\n').count() + 1)
}

/// Where a key stands: a list of tables (`[[planes]]`) has its own place.
fn start(key: usize, value: &Spanned<DeValue<'_>>) -> usize {
    if value.get_ref().is_table() { key } else { key.min(value.span().start) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "name = \"x\"\n\n[arm]\naddress = \"sim\"\npayload_kg = -1\n[machine]\n";

    #[test]
    fn a_field_has_its_line_and_a_missing_one_that_of_its_table() {
        assert_eq!(line_of(TEXT, "name"), Some(1));
        assert_eq!(line_of(TEXT, "arm.payload_kg"), Some(5));
        assert_eq!(line_of(TEXT, "arm.model"), Some(3));
        assert_eq!(line_of(TEXT, "machine.setting.depth_mm"), Some(6));
        assert_eq!(line_of(TEXT, "workspace"), None);
        assert_eq!(line_of("no toml", "name"), None);
    }

    #[test]
    fn what_is_no_number_is_within_no_bounds() {
        let wrong = within("arm.payload_kg", f64::NAN, (0.0, 50.0), "kg").unwrap_err();
        assert_eq!(wrong.told(TEXT), "line 5: arm.payload_kg is NaN; it has to be between 0 and 50 kg");
    }
}
