//! The dots of every image, on every core.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::{Doing, Reason, SpatialError, SpatialOptions};
use crate::PixelSpacing;
use crate::dots::{BadDots, Dot, DotFinder, DotSettings};
use crate::shots::{Shot, Shots};

/// The dots of one image, or why there is none.
pub(super) type Looked = Result<Vec<Dot>, Reason>;

/// The dots of every image, in the recording's order.
pub(super) fn dots(
    shots: &Shots,
    options: &SpatialOptions,
    spacing: Option<PixelSpacing>,
    watch: &(dyn Fn(Doing) + Sync),
) -> Result<Vec<Looked>, SpatialError> {
    let settings = spacing.map_or_else(DotSettings::default, DotSettings::for_spacing);
    let (all, done) = (shots.shots(), AtomicUsize::new(0));
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    let part = |part: &[Shot]| -> Result<Vec<Looked>, BadDots> {
        let (width, height) = shots.size();
        let mut finder = DotFinder::new(settings, &options.mask, width, height)?;
        let one = |shot: &Shot| {
            watch(Doing::Looking { done: done.fetch_add(1, Ordering::Relaxed) + 1, of: all.len() });
            look(shot, &mut finder)
        };
        part.iter().map(one).collect()
    };
    let parts: Result<Vec<Vec<Looked>>, BadDots> = thread::scope(|scope| {
        let part = &part;
        let spawn = |shots| scope.spawn(move || part(shots));
        let threads: Vec<_> = all.chunks(all.len().div_ceil(cores).max(1)).map(spawn).collect();
        // A panic is a bug, here as anywhere: it goes on in the thread that asked.
        let joined =
            threads.into_iter().map(|t| t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        joined.collect()
    });
    Ok(parts?.into_iter().flatten().collect())
}

fn look(shot: &Shot, finder: &mut DotFinder) -> Result<Looked, BadDots> {
    match &shot.pixels {
        Ok(pixels) => finder.find(pixels).map(Ok),
        Err(reason) => Ok(Err(Reason::Image(reason.clone()))),
    }
}
