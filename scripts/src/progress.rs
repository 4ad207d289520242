//! How far long work is.

use probepath_recon::View;

/// Hears how far long work is, and may be asked; a bar, a page, or nobody.
pub trait Progress: Send + Sync {
    /// A step of the work is done to `fraction` (0 to 1).
    fn at(&self, step: &str, fraction: f64);

    /// Something worth a line.
    fn say(&self, text: &str);

    /// Whether [`vessel`](Self::vessel) is listened to: it costs some milliseconds of a thread for every B-scan.
    fn watches_vessel(&self) -> bool {
        false
    }

    /// The vessel as far as the scan under way has shown it; called from a thread of its own.
    fn vessel(&self, _so_far: &View) {}

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
