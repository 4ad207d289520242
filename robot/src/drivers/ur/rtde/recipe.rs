//! [`Recipe`]: what a data package holds, as both ends agreed.

use thiserror::Error;

use super::{RtdeError, Type, Value, names};

/// What the packages of one recipe hold: a field after the other, without gaps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recipe {
    number: u8,
    fields: Vec<Field>,
    size: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Field {
    kind: Type,
    at: usize,
}

/// Fields that a controller does not give.
#[derive(Clone, Debug, Default, Error, PartialEq, Eq)]
#[error(
    "the controller refused the recipe{}{}{}",
    said(" has no ", missing),
    said(" lets another client hold ", taken),
    none(missing, taken)
)]
pub struct Refused {
    /// What it does not know: an older version has fewer.
    pub missing: Vec<String>,
    /// What another client holds.
    pub taken: Vec<String>,
}

fn said(what: &str, names: &[String]) -> String {
    if names.is_empty() { String::new() } else { format!(": it{what}{}", names.join(", ")) }
}

fn none(missing: &[String], taken: &[String]) -> &'static str {
    if missing.is_empty() && taken.is_empty() { ", and does not say why" } else { "" }
}

impl Recipe {
    /// What was agreed: the names that were asked for (with commas between), and the number and the types of the
    /// answer.
    ///
    /// # Errors
    /// When the controller does not give a field, or gives it another type than it has.
    pub fn agreed(
        asked: &str,
        type_of: impl Fn(&str) -> Option<Type>,
        number: u8,
        types: &str,
    ) -> Result<Self, RtdeError> {
        let asked: Vec<&str> = names(asked).collect();
        let types: Vec<&str> = names(types).collect();
        refused(&asked, &types)?;
        if asked.len() != types.len() {
            return Err(RtdeError::WrongCount { types: types.len(), names: asked.len() });
        }
        let kinds: Result<Vec<Type>, RtdeError> =
            asked.iter().zip(&types).map(|(name, kind)| checked(name, kind, &type_of)).collect();
        Ok(Self::new(number, kinds?))
    }

    /// A recipe of these types; the controller's side of it.
    pub fn new(number: u8, types: impl IntoIterator<Item = Type>) -> Self {
        let mut size = 0;
        let place = |kind: Type| {
            let at = size;
            size += kind.size();
            Field { kind, at }
        };
        let fields = types.into_iter().map(place).collect();
        Self { number, fields, size }
    }

    /// Its number.
    pub const fn number(&self) -> u8 {
        self.number
    }

    /// How many bytes its fields have.
    pub const fn size(&self) -> usize {
        self.size
    }

    /// How many fields it has.
    pub fn len(&self) -> usize {
        self.fields.len()
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.fields.is_empty()
    }

    /// The types, in order.
    pub fn types(&self) -> impl Iterator<Item = Type> {
        self.fields.iter().map(|field| field.kind)
    }

    /// That a package is of this recipe, and as long as its types say.
    ///
    /// # Errors
    /// When it is not.
    pub fn check(&self, number: u8, fields: &[u8]) -> Result<(), RtdeError> {
        if number != self.number {
            return Err(RtdeError::Recipe { found: number, expected: self.number });
        }
        if fields.len() != self.size {
            return Err(RtdeError::Package { recipe: number, found: fields.len(), expected: self.size });
        }
        Ok(())
    }

    /// The value of field `index` in a package's fields; `None` when there is no such field in them.
    pub fn value(&self, index: usize, fields: &[u8]) -> Option<Value> {
        let Field { kind, at } = *self.fields.get(index)?;
        kind.read(fields.get(at..at.checked_add(kind.size())?)?)
    }

    /// The values of a package's fields, in order, as far as they are there.
    pub fn values(&self, fields: &[u8]) -> impl Iterator<Item = Value> {
        (0..self.fields.len()).map_while(move |index| self.value(index, fields))
    }
}

fn refused(asked: &[&str], types: &[&str]) -> Result<(), RtdeError> {
    let those = |word: &str| -> Vec<String> {
        let hit = asked.iter().zip(types).filter(|(_, kind)| **kind == word);
        hit.map(|(name, _)| (*name).to_owned()).collect()
    };
    let refused = Refused { missing: those("NOT_FOUND"), taken: those("IN_USE") };
    // A single word may stand for all of them.
    let all = types.len() == 1 && asked.len() > 1 && matches!(types, ["NOT_FOUND" | "IN_USE"]);
    match types {
        [] if !asked.is_empty() => Err(RtdeError::Refused(refused)),
        ["NOT_FOUND"] if all => {
            Err(RtdeError::Refused(Refused { missing: owned(asked), ..Refused::default() }))
        }
        ["IN_USE"] if all => Err(RtdeError::Refused(Refused { taken: owned(asked), ..Refused::default() })),
        _ if refused != Refused::default() => Err(RtdeError::Refused(refused)),
        _ => Ok(()),
    }
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn checked(name: &str, kind: &str, type_of: impl Fn(&str) -> Option<Type>) -> Result<Type, RtdeError> {
    let found = Type::from_name(kind)
        .ok_or_else(|| RtdeError::UnknownType { name: name.into(), found: kind.into() })?;
    match type_of(name) {
        Some(expected) if expected != found => {
            Err(RtdeError::WrongType { name: name.into(), found, expected })
        }
        _ => Ok(found),
    }
}
