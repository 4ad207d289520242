//! How far long work is.

/// Hears how far long work is, and may be asked; a bar, a page, or nobody.
pub trait Progress: Send + Sync {
    /// A step of the work is done to `fraction` (0 to 1).
    fn at(&self, step: &str, fraction: f64);

    /// Something worth a line.
    fn say(&self, text: &str);

    /// Asks the person who watches whether the arm may do what `question` says. Nobody says no.
    fn confirm(&self, question: &str) -> bool {
        self.say(question);
        false
    }
}

/// Nobody listens.
impl Progress for () {
    fn at(&self, _: &str, _: f64) {}
    fn say(&self, _: &str) {}
}
