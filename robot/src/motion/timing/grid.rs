//! [`Grid`]: where the speed is looked for, and a slow motion to begin with.

use super::way::Way;
use super::{Launch, PathSpeed};

/// Cells in the middle of the path: as many as postures, within these.
const CELLS: (usize, usize) = (300, 700);
/// The launch takes this part of the time in which a full jerk reaches the first of the other limits.
const LAUNCH: f64 = 0.04;
/// After it each cell takes this much more time than the last, at a constant jerk.
const GROWTH: f64 = 1.1;
/// Part of the jerk that a launch uses: the rest lets the search begin inside the limits.
const EASY: f64 = 0.985;
/// Part of the lowest steady speed that the search begins with.
const SLOW: f64 = 0.3;

/// The cells, and the first control points.
pub(super) struct Grid {
    pub(super) nodes: Vec<f64>,
    pub(super) control: Vec<f64>,
    pub(super) launch: Launch,
    pub(super) landing: Launch,
}

impl Grid {
    /// Cells that are small where the speed changes much: toward both ends.
    pub(super) fn new(way: &Way, wanted: &PathSpeed, speeds: &[f64]) -> Self {
        let length = way.length();
        let even = length / way.pieces().clamp(CELLS.0, CELLS.1) as f64;
        let launch = launch(way, wanted, 0.0);
        let landing = launch_at_end(way, wanted);
        let (ahead, behind) = (graded(&launch, even, 0.5 * length), graded(&landing, even, 0.5 * length));
        let (from, until) =
            (ahead.last().copied().unwrap_or(0.0), length - behind.last().copied().unwrap_or(0.0));
        let between = (((until - from) / even).ceil() as usize).max(1);
        let mut nodes = ahead;
        nodes.extend((1..between).map(|k| from + (until - from) * k as f64 / between as f64));
        nodes.extend(behind.iter().rev().map(|s| length - s));
        let slowest = speeds.iter().fold(f64::INFINITY, |m, v| m.min(*v));
        let control = begin(&nodes, length, &launch, &landing, SLOW * slowest);
        Self { nodes, control, launch, landing }
    }
}

/// The fullest jerk from rest at `s`.
fn launch(way: &Way, wanted: &PathSpeed, s: f64) -> Launch {
    let slopes = way.at(s);
    let most = |order: usize, own: f64| {
        let joints = slopes[0].component_mul(&way.per()[order]).amax();
        own.min(1.0 / joints)
    };
    let jerk = EASY * most(2, wanted.jerk);
    let acceleration = most(1, wanted.acceleration);
    let speed = way.steady(&slopes, wanted.speed);
    let bounds = [acceleration / jerk, (2.0 * speed / jerk).sqrt(), 0.3 * (6.0 * way.length() / jerk).cbrt()];
    Launch { jerk, lasts: LAUNCH * bounds.iter().fold(f64::INFINITY, |m, t| m.min(*t)) }
}

fn launch_at_end(way: &Way, wanted: &PathSpeed) -> Launch {
    launch(way, wanted, way.length())
}

/// Distances from an end, from the launch's until the cells are even.
fn graded(launch: &Launch, even: f64, most: f64) -> Vec<f64> {
    let mut time = launch.lasts;
    let mut nodes = vec![launch.way()];
    loop {
        let last = launch.jerk * time.powi(3) / 6.0;
        time *= GROWTH;
        let next = launch.jerk * time.powi(3) / 6.0;
        if next - last > even || next > most {
            return nodes;
        }
        nodes.push(next);
    }
}

/// A slow motion: a launch, a steady speed, a landing; with the ends' value and slope exactly.
fn begin(nodes: &[f64], length: f64, launch: &Launch, landing: &Launch, slow: f64) -> Vec<f64> {
    let cells = nodes.len() - 1;
    let rise =
        |launch: &Launch, s: f64| 0.25 * launch.jerk * launch.jerk * (6.0 * s / launch.jerk).powf(4.0 / 3.0);
    let at = |s: f64| {
        let three = [rise(launch, s), rise(landing, length - s), slow * slow];
        three.iter().map(|b| b.powi(-2)).sum::<f64>().powf(-0.5)
    };
    let node = |i: usize| nodes[i.min(cells)];
    let mut control: Vec<f64> =
        (0..cells + 2).map(|i| at(0.5 * (node(i.saturating_sub(1)) + node(i)))).collect();
    let (first, last) = (launch.speed().powi(2), landing.speed().powi(2));
    control[0] = first;
    control[1] = first + launch.acceleration() * (node(1) - node(0));
    control[cells + 1] = last;
    control[cells] = last + landing.acceleration() * (node(cells) - node(cells - 1));
    control
}
