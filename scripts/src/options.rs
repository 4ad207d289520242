//! Reading the option maps of a protocol: every key is known, every value is of its kind, or the error says which
//! and shows how it is written.

use rhai::{Array, Dynamic, Map};

use crate::quantity::{Quantity, describe};

/// The options of one step, taken out key by key.
#[derive(Debug)]
pub struct Options {
    step: &'static str,
    map: Map,
    known: Vec<&'static str>,
}

impl Options {
    /// The options given to `step`.
    pub const fn new(step: &'static str, map: Map) -> Self {
        Self { step, map, known: Vec::new() }
    }

    /// A quantity, when the key is there.
    ///
    /// # Errors
    /// When the value is of another kind, or not finite.
    pub fn quantity<Q: Quantity>(&mut self, key: &'static str) -> Result<Option<Q>, String> {
        let Some(value) = self.take(key) else { return Ok(None) };
        let shown = describe(&value);
        value.try_cast::<Q>().map(Some).ok_or_else(|| {
            format!("{}: `{key}` is {}, written as {}; found {}", self.step, Q::KIND, Q::EXAMPLE, shown)
        })
    }

    /// A number of things, when the key is there.
    ///
    /// # Errors
    /// When the value is no whole number, or below zero.
    pub fn count(&mut self, key: &'static str) -> Result<Option<usize>, String> {
        let Some(value) = self.take(key) else { return Ok(None) };
        let count = value.as_int().ok().and_then(|count| usize::try_from(count).ok());
        count.map(Some).ok_or_else(|| {
            format!("{}: `{key}` is a number of things, written as 24; found {}", self.step, describe(&value))
        })
    }

    /// Yes or no, when the key is there.
    ///
    /// # Errors
    /// When the value is neither.
    pub fn flag(&mut self, key: &'static str) -> Result<Option<bool>, String> {
        let Some(value) = self.take(key) else { return Ok(None) };
        value
            .as_bool()
            .map(Some)
            .map_err(|_| format!("{}: `{key}` is true or false; found {}", self.step, describe(&value)))
    }

    /// A text, when the key is there.
    ///
    /// # Errors
    /// When the value is no text.
    pub fn text(&mut self, key: &'static str) -> Result<Option<String>, String> {
        let Some(value) = self.take(key) else { return Ok(None) };
        let shown = describe(&value);
        value.into_string().map(Some).map_err(|_| format!("{}: `{key}` is a text; found {shown}", self.step))
    }

    /// A list, when the key is there.
    ///
    /// # Errors
    /// When the value is no list.
    pub fn list(&mut self, key: &'static str) -> Result<Option<Array>, String> {
        let Some(value) = self.take(key) else { return Ok(None) };
        let shown = describe(&value);
        value.into_array().map(Some).map_err(|_| format!("{}: `{key}` is a list; found {shown}", self.step))
    }

    /// Refuses what was not asked for, and says what could have been.
    ///
    /// # Errors
    /// When a key is left.
    pub fn done(self) -> Result<(), String> {
        let Some(key) = self.map.keys().next() else { return Ok(()) };
        Err(format!("{}: no option is called `{key}`; there are {}", self.step, self.known.join(", ")))
    }

    fn take(&mut self, key: &'static str) -> Option<Dynamic> {
        self.known.push(key);
        self.map.remove(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::{Force, Length};

    fn options(script: &str) -> Options {
        let mut engine = rhai::Engine::new();
        crate::quantity::register(&mut engine);
        Options::new("scan", engine.eval(script).unwrap())
    }

    #[test]
    fn a_bare_number_is_refused_with_the_way_to_write_it() {
        let error = options("#{ force: 5 }").quantity::<Force>("force").unwrap_err();
        assert_eq!(
            error,
            "scan: `force` is a force, written as newton(5); found 5, a bare number without a unit"
        );
    }

    #[test]
    fn a_wrong_unit_is_refused() {
        let error = options("#{ every: newton(5) }").quantity::<Length>("every").unwrap_err();
        assert_eq!(error, "scan: `every` is a length, written as mm(120); found `5 N`");
    }

    #[test]
    fn an_unknown_option_is_named_beside_those_there_are() {
        let mut some = options("#{ evry: mm(1) }");
        some.quantity::<Length>("every").unwrap();
        assert_eq!(some.done().unwrap_err(), "scan: no option is called `evry`; there are every");
    }
}
