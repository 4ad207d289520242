//! Attributes of PLUS's XML as numbers and words, with the line in every error.

use std::str::FromStr;

use nalgebra::Matrix4;
use roxmltree::Node;

use super::{PlusError, PlusTransform};

pub(super) fn transforms(root: Node<'_, '_>) -> Result<Vec<PlusTransform>, PlusError> {
    let home =
        |n: &Node<'_, '_>| n.has_tag_name("CoordinateDefinitions") || n.has_tag_name("CalibrationResults");
    let inside = root.descendants().filter(home).flat_map(|n| n.children());
    inside.filter(|n| n.has_tag_name("Transform")).map(transform).collect()
}

fn transform(node: Node<'_, '_>) -> Result<PlusTransform, PlusError> {
    let numbers = finite(node, "Matrix", 16)?.ok_or_else(|| missing(node, "Matrix"))?;
    let word = |name| node.attribute(name).map(str::to_owned).ok_or_else(|| missing(node, name));
    Ok(PlusTransform {
        from: word("From")?,
        to: word("To")?,
        matrix_mm: Matrix4::from_row_iterator(numbers),
        error_mm: node.attribute("Error").and_then(|e| e.trim().parse().ok()),
        date: node.attribute("Date").map(str::to_owned),
    })
}

/// So many numbers in one attribute; `None` when it is not there.
pub(super) fn numbers<T: FromStr>(
    node: Node<'_, '_>,
    name: &'static str,
    count: usize,
) -> Result<Option<Vec<T>>, PlusError> {
    let Some(text) = node.attribute(name) else { return Ok(None) };
    let numbers: Vec<T> = text
        .split_whitespace()
        .map(|word| word.parse().map_err(|_| bad(node, name, format!("{word:?} is not such a number"))))
        .collect::<Result<_, _>>()?;
    if numbers.len() != count {
        return Err(bad(node, name, format!("{count} numbers were expected, {} came", numbers.len())));
    }
    Ok(Some(numbers))
}

/// So many finite numbers in one attribute: `nan` and `1e400` are read as numbers too.
pub(super) fn finite(
    node: Node<'_, '_>,
    name: &'static str,
    count: usize,
) -> Result<Option<Vec<f64>>, PlusError> {
    match numbers::<f64>(node, name, count)? {
        Some(numbers) if numbers.iter().any(|x| !x.is_finite()) => {
            Err(bad(node, name, "a number is not finite"))
        }
        numbers => Ok(numbers),
    }
}

pub(super) fn missing(node: Node<'_, '_>, attribute: &'static str) -> PlusError {
    PlusError::MissingAttribute { line: line(node), element: node.tag_name().name().into(), attribute }
}

pub(super) fn bad(node: Node<'_, '_>, attribute: &str, why: impl Into<String>) -> PlusError {
    let value = node.attribute(attribute).unwrap_or_default().chars().take(60).collect();
    PlusError::BadAttribute { line: line(node), attribute: attribute.into(), value, why: why.into() }
}

pub(super) fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}
