//! [`Live`]: the vessel while it is being scanned, on a thread of its own.

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use probepath_recon::{LiveLumen, LumenSettings, ReconError};
use probepath_us_capture::PlacedBScan;

use crate::progress::Progress;

/// So many B-scans may wait to be looked at: three seconds of them at 20 mm/s, one every millimetre.
const WAITING: usize = 60;

/// Looks at the B-scans of a scan as they come and tells who watches. It holds nobody up: what comes while too many
/// wait is not looked at, and counted.
pub(super) struct Live {
    images: SyncSender<(PlacedBScan, Instant)>,
    thread: JoinHandle<Shown>,
    left_out: usize,
}

/// What was shown while a scan went on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shown {
    /// How often.
    pub(super) views: usize,
    /// From a B-scan being kept to the view that has it: the longest.
    pub(super) longest: Duration,
    /// B-scans there was no time for.
    pub(super) left_out: usize,
}

impl Live {
    /// Begins to look.
    ///
    /// # Errors
    /// When the settings make no sense.
    pub(super) fn start(settings: LumenSettings, progress: Arc<dyn Progress>) -> Result<Self, ReconError> {
        let lumen = LiveLumen::new(settings)?;
        let (images, coming) = sync_channel(WAITING);
        let thread = std::thread::spawn(move || look(lumen, &coming, &*progress));
        Ok(Self { images, thread, left_out: 0 })
    }

    /// One more B-scan.
    pub(super) fn see(&mut self, image: &PlacedBScan) {
        if let Err(TrySendError::Full(_)) = self.images.try_send((image.clone(), now())) {
            self.left_out += 1;
        }
    }

    /// No more come. A panic over there is no reason to lose a scan: then nothing was shown.
    pub(super) fn finish(self) -> Shown {
        let Self { images, thread, left_out } = self;
        drop(images);
        Shown { left_out, ..thread.join().unwrap_or_default() }
    }
}

#[expect(clippy::disallowed_methods, reason = "how long a person waits for the view is the wall's time")]
fn now() -> Instant {
    Instant::now()
}

/// Takes all that waits, then shows what it makes.
fn look(mut lumen: LiveLumen, coming: &Receiver<(PlacedBScan, Instant)>, progress: &dyn Progress) -> Shown {
    let mut shown = Shown::default();
    while let Ok((first, kept)) = coming.recv() {
        let rest = std::iter::from_fn(|| coming.try_recv().ok()).map(|(image, _)| image);
        for image in std::iter::once(first).chain(rest) {
            // An image of no size or place makes no view; the reconstruction says so of it.
            let _ = lumen.push(&image);
        }
        progress.vessel(&lumen.view());
        shown.views += 1;
        shown.longest = shown.longest.max(kept.elapsed());
    }
    shown
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { views, longest, left_out } = self;
        let longest = longest.as_secs_f64() * 1e3;
        write!(
            f,
            "The vessel was shown {views} times during the scan, at most {longest:.0} ms after a B-scan"
        )?;
        if *left_out > 0 {
            write!(f, "; for {left_out} B-scans there was no time")?;
        }
        write!(f, ".")
    }
}
