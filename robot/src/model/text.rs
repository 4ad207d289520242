//! What has to be looked at in a URDF's text, because its reader would not come back or would not tell.

/// Elements of a URDF nest five deep; the XML reader recurses, so a file made to nest without end would take the
/// stack with it.
const MAX_DEPTH: usize = 64;

/// Whether the reader may be given this text; if not, why.
pub(super) fn check(text: &str) -> Result<(), String> {
    let mut depth = Depth::default();
    for part in outside_comments(text) {
        depth.count(part);
        if depth.most > MAX_DEPTH {
            return Err(format!("elements are nested more than {MAX_DEPTH} deep"));
        }
        three_numbers(part)?;
    }
    if depth.most == 0 {
        return Err("it has no XML element".into());
    }
    Ok(())
}

fn outside_comments(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let (part, comment) = match rest?.split_once("<!--") {
            Some((part, comment)) => (part, comment.split_once("-->").map(|(_, after)| after)),
            None => (rest?, None),
        };
        rest = comment;
        Some(part)
    })
}

/// How deep elements nest, or more: every `<name` counts until a `</` or `/>`.
#[derive(Default)]
struct Depth {
    now: usize,
    most: usize,
}

impl Depth {
    fn count(&mut self, text: &str) {
        for pair in text.as_bytes().windows(2) {
            match pair {
                b"</" | b"/>" => self.now = self.now.saturating_sub(1),
                [b'<', next] if next.is_ascii_alphabetic() => self.now += 1,
                _ => {}
            }
            self.most = self.most.max(self.now);
        }
    }
}

/// Every `xyz` and `rpy` has three numbers: the reader leaves out what is not a number, and takes the three that
/// remain of "0 O.5 0 1".
fn three_numbers(text: &str) -> Result<(), String> {
    for name in ["xyz", "rpy"] {
        for (at, _) in text.match_indices(name) {
            let Some(value) = attribute(text, at, name) else { continue };
            let good = value.split_whitespace().filter(|word| word.parse::<f64>().is_ok()).count();
            if good != 3 || value.split_whitespace().count() != 3 {
                return Err(format!("{name}=\"{value}\" is not three numbers"));
            }
        }
    }
    Ok(())
}

/// The value of the attribute whose name begins at `at`, if that is an attribute.
fn attribute<'a>(text: &'a str, at: usize, name: &str) -> Option<&'a str> {
    if !text.get(..at)?.ends_with(|c: char| c.is_whitespace()) {
        return None;
    }
    let value = text.get(at + name.len()..)?.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|c| *c == '"' || *c == '\'')?;
    value.get(1..)?.split_once(quote).map(|(inside, _)| inside)
}
