//! How far along the path each sample is; pauses and doubling back bring nothing forward.

use nalgebra::Vector3;

/// Distance between the vertices of the line that progress is measured on (m).
const STRIDE: f64 = 0.001;
/// Vertices from an end of the line within which a sample is still at the front.
const FRONT: usize = 3;
/// Vertices over which the line's heading at an end is measured.
const HEADING: usize = 10;
/// Cosine to the heading below which a place is behind the end, not ahead of it: no path on a leg turns by more within
/// the length of its heading, but a hand that doubles back beside what it did does.
const BEHIND: f64 = -0.5;

/// A line that grows at whichever end the probe moves on from; coming back along it adds nothing.
#[derive(Debug, Default)]
pub(super) struct Progress {
    /// Vertices from the first place onwards.
    after: Vec<Vector3<f64>>,
    /// Vertices from the first place backwards, when the hand set off the wrong way first.
    before: Vec<Vector3<f64>>,
    /// For each sample, where it is: vertex (negative in `before`), and whether it was at the front.
    seen: Vec<(i64, bool)>,
}

impl Progress {
    /// Progress along `places`.
    pub(super) fn of(places: impl Iterator<Item = Vector3<f64>>) -> Self {
        let mut progress = Self::default();
        for place in places {
            progress.add(place);
        }
        progress
    }

    fn add(&mut self, place: Vector3<f64>) {
        let Some((nearest, distance)) = self.nearest(&place) else {
            self.after.push(place);
            self.seen.push((0, true));
            return;
        };
        let (last, first) = (self.after.len() as i64 - 1, -(self.before.len() as i64));
        let reach = FRONT as i64;
        if nearest == last && distance >= STRIDE && self.is_ahead(last, -1, &place) {
            self.after.push(place);
            self.seen.push((last + 1, true));
        } else if nearest == first && distance >= STRIDE && self.is_ahead(first, 1, &place) {
            self.before.push(place);
            self.seen.push((first - 1, true));
        } else {
            self.seen.push((nearest, nearest > last - reach || nearest < first + reach));
        }
    }

    /// Whether a place beyond the line's end leads on from it; `inward` is the step of index away from that end.
    fn is_ahead(&self, end: i64, inward: i64, place: &Vector3<f64>) -> bool {
        let (last, first) = (self.after.len() as i64 - 1, -(self.before.len() as i64));
        let inside = (end + inward * HEADING as i64).clamp(first, last);
        let (end, inside) = (self.vertex(end), self.vertex(inside));
        let (heading, step) = (end - inside, place - end);
        step.dot(&heading) >= BEHIND * step.norm() * heading.norm()
    }

    fn vertex(&self, index: i64) -> Vector3<f64> {
        let list =
            if index >= 0 { self.after.get(index as usize) } else { self.before.get((-index - 1) as usize) };
        list.copied().unwrap_or_default()
    }

    fn nearest(&self, place: &Vector3<f64>) -> Option<(i64, f64)> {
        (-(self.before.len() as i64)..self.after.len() as i64)
            .map(|i| (i, (self.vertex(i) - place).norm_squared()))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(i, squared)| (i, squared.sqrt()))
    }

    /// For each place given to [`Self::of`], the nearest of the line when the hand was going back over it.
    pub(super) fn doubled(&self) -> impl Iterator<Item = Option<Vector3<f64>>> {
        self.seen.iter().map(|(index, front)| (!front).then(|| self.vertex(*index)))
    }

    /// The line in the order of the main direction of travel, and for each of `places` (as given to [`Self::of`])
    /// how far along it is (m), or `None` where the hand was going back over what it had already done.
    pub(super) fn along(&self, places: impl Iterator<Item = Vector3<f64>>) -> Vec<Option<f64>> {
        let forward = self.after.len() > self.before.len();
        let first = -(self.before.len() as i64);
        let vertices: Vec<Vector3<f64>> = (first..self.after.len() as i64).map(|i| self.vertex(i)).collect();
        let lengths = lengths(&vertices);
        let total = lengths.last().copied().unwrap_or(0.0);
        let measure = |place: Vector3<f64>, index: i64| {
            let s = project(&vertices, &lengths, (index - first) as usize, &place);
            if forward { s } else { total - s }
        };
        self.seen
            .iter()
            .zip(places)
            .map(|((index, front), place)| front.then(|| measure(place, *index)))
            .collect()
    }
}

/// Length from the first vertex to each.
fn lengths(vertices: &[Vector3<f64>]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut all = vec![0.0; vertices.len().min(1)];
    for pair in vertices.windows(2) {
        sum += (pair[1] - pair[0]).norm();
        all.push(sum);
    }
    all
}

/// How far along the line `place` is, near vertex `index`.
fn project(vertices: &[Vector3<f64>], lengths: &[f64], index: usize, place: &Vector3<f64>) -> f64 {
    let (from, until) = (index.saturating_sub(2), (index + 2).min(vertices.len() - 1));
    let way = vertices[until] - vertices[from];
    let Some(way) = way.try_normalize(1e-9) else { return lengths[index] };
    lengths[index] + (place - vertices[index]).dot(&way)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along(xs: &[f64]) -> Vec<Option<f64>> {
        let places = || xs.iter().map(|x| Vector3::new(*x, 0.0, 0.0));
        Progress::of(places()).along(places())
    }

    fn walk(turns: &[f64]) -> Vec<f64> {
        let steps = |pair: &[f64]| {
            let (a, b) = (pair[0], pair[1]);
            let n = ((b - a).abs() / 0.0002) as usize;
            (0..n).map(move |i| a + (b - a) * i as f64 / n as f64).collect::<Vec<_>>()
        };
        turns.windows(2).flat_map(steps).collect()
    }

    #[test]
    fn doubling_back_brings_nothing_forward() {
        let xs = walk(&[0.0, 0.10, 0.07, 0.20]);
        let found = along(&xs);
        let behind = found.iter().filter(|s| s.is_none()).count();
        assert!(behind > 200 && behind < 320, "{behind}");
        for (x, s) in xs.iter().zip(&found) {
            assert!(s.is_none_or(|s| (s - x).abs() < 1e-9), "{x} {s:?}");
        }
    }

    #[test]
    fn setting_off_the_wrong_way_is_part_of_the_path_and_turned_round() {
        let xs = walk(&[0.0, -0.012, 0.15]);
        let found = along(&xs);
        for (x, s) in xs.iter().zip(&found) {
            assert!(s.is_none_or(|s| (s - (x + 0.0118)).abs() < 1e-3), "{x} {s:?}");
        }
    }

    #[test]
    fn doubling_back_beside_what_was_done_neither_turns_the_line_nor_ends_it() {
        let there = walk(&[0.0, 0.10]).into_iter().map(|x| Vector3::new(x, 0.0, 0.0));
        for beside in [0.001, 0.002, 0.004, 0.006] {
            let aside = walk(&[0.0, beside]).into_iter().map(|y| Vector3::new(0.10, y, 0.0));
            let back = walk(&[0.10, 0.08, 0.20]).into_iter().map(|x| Vector3::new(x, beside, 0.0));
            let places: Vec<_> = there.clone().chain(aside).chain(back).collect();
            let found = Progress::of(places.iter().copied()).along(places.iter().copied());
            let end = found.last().copied().flatten();
            assert!(end.is_some_and(|s| (s - 0.20).abs() < 0.006), "{beside}: {end:?}");
            let most = found.iter().flatten().fold(0.0_f64, |most, s| most.max(*s));
            assert!((most - 0.20).abs() < 0.006, "{beside}: {most}");
        }
    }
}
