//! Hole filling by sticks (as PLUS's `STICK`): a straight line of voxels through the hole, in one of 13 directions, that
//! ends in seen voxels on both sides.

use rayon::prelude::*;

use super::{Mark, Sticks, Volume};

/// Half of the 26 neighbours; the other half are the same sticks backwards.
const DIRECTIONS: [[i64; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, 0, 1],
    [0, 1, 1],
    [1, -1, 0],
    [1, 0, -1],
    [0, 1, -1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [-1, 1, 1],
];

/// Fills from what was seen only, never from what was filled.
pub(super) fn fill(volume: &mut Volume, sticks: Sticks) {
    let seen = &*volume;
    let [nx, ny, _] = seen.grid.size;
    let fill = |index: usize| match seen.marks.get(index) {
        Some(Mark::Unseen) => value(seen, [index % nx, index / nx % ny, index / (nx * ny)], sticks),
        _ => None,
    };
    let filled: Vec<Option<u8>> = (0..seen.grey.len()).into_par_iter().map(fill).collect();
    for ((grey, mark), filled) in volume.grey.iter_mut().zip(&mut volume.marks).zip(filled) {
        if let Some(filled) = filled {
            (*grey, *mark) = (filled, Mark::Filled);
        }
    }
}

/// A stick that ends in seen voxels on both sides.
#[derive(Clone, Copy)]
struct Stick {
    /// Its length squared, in voxels: whole numbers, so that equal lengths are equal.
    length_squared: i64,
    /// Interpolated at the hole.
    value: f64,
}

/// The mean of the shortest sticks, each weighted by one over its length; sticks as long as the last one taken are
/// taken too.
fn value(volume: &Volume, hole: [usize; 3], sticks: Sticks) -> Option<u8> {
    let mut found: Vec<Stick> = Vec::new();
    found.extend(DIRECTIONS.iter().filter_map(|direction| stick(volume, hole, *direction, sticks.longest)));
    found.sort_by_key(|s| s.length_squared);
    let longest = found.get(sticks.at_least.max(1).min(found.len()).checked_sub(1)?)?.length_squared;
    let (mut sum, mut weights) = (0.0, 0.0);
    for stick in found.iter().take_while(|s| s.length_squared <= longest) {
        let weight = 1.0 / (stick.length_squared as f64).sqrt();
        sum += weight * stick.value;
        weights += weight;
    }
    Some((sum / weights).round() as u8)
}

fn stick(volume: &Volume, hole: [usize; 3], direction: [i64; 3], longest: usize) -> Option<Stick> {
    // The hole itself and the voxel at the other end belong to the stick too.
    let (ahead, front) = first_seen(volume, hole, direction, longest.saturating_sub(2))?;
    let back = direction.map(|d| -d);
    let (behind, rear) = first_seen(volume, hole, back, longest.saturating_sub(1 + ahead))?;
    let total = (ahead + behind) as f64;
    let value = (f64::from(front) * behind as f64 + f64::from(rear) * ahead as f64) / total;
    let voxels = (ahead + behind + 1) as i64;
    let length_squared = voxels * voxels * direction.iter().map(|d| d * d).sum::<i64>();
    Some(Stick { length_squared, value })
}

/// Steps to the first seen voxel, and its grey level.
fn first_seen(volume: &Volume, hole: [usize; 3], direction: [i64; 3], most: usize) -> Option<(usize, u8)> {
    for steps in 1..=most {
        let along = |axis: usize| hole[axis].checked_add_signed(direction[axis] as isize * steps as isize);
        let index = volume.grid.index([along(0)?, along(1)?, along(2)?])?;
        if volume.marks.get(index) == Some(&Mark::Seen) {
            return volume.grey.get(index).map(|grey| (steps, *grey));
        }
    }
    None
}
