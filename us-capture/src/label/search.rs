//! From first guesses to choices of wires: where along the phantom, how tilted, which dot on which wire.

use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};

use super::anchors::{Allowed, Guess, Lay, Places, Search};
use super::assign::{Window, assign, worth};
use super::plane::{Match, Plane};
use super::section::Section;
use super::seen::Seen;
use super::{Choice, Labeller};

/// Sections of a phantom without enough parallel wires are tried this far apart (m).
const STEP_M: f64 = 3.0e-3;
/// Dots of sliding wires agree on the place along the phantom within this (m), and this times their distance.
const AGREE_M: f64 = 3.0e-3;
/// Steepest slope of the image's plane along the phantom.
const STEEP: f64 = 0.5;
/// No more choices than this are refined.
const MOST: usize = 60;

/// Places that guesses are made of: of the parallel wires, which are the same in every section, or of all wires in
/// one section.
#[derive(Clone, Debug)]
pub(super) struct Round {
    places: Places,
    wires: Vec<usize>,
    /// Where along the phantom, when all wires are among the places.
    z: Option<f64>,
}

pub(super) fn rounds(section: &Section) -> Vec<Round> {
    if section.straight.len() >= 3 {
        let at = section.straight.iter().map(|&i| section.strands[i].front.xy()).collect();
        return vec![Round { places: Places::new(at), wires: section.straight.clone(), z: None }];
    }
    let steps = (((section.reach.1 - section.reach.0) / STEP_M).ceil() as usize).clamp(1, 60);
    let step = (section.reach.1 - section.reach.0) / steps as f64;
    let round = |k: usize| {
        let z = section.reach.0 + (k as f64 + 0.5) * step;
        let (wires, at) = section.at(z).into_iter().unzip();
        Round { places: Places::new(at), wires, z: Some(z) }
    };
    (0..steps).map(round).collect()
}

impl Labeller {
    /// All choices worth a look, the best first.
    pub(super) fn search(&self, seen: &[Seen], window: &Window) -> Vec<Choice> {
        let mut starts = Vec::new();
        for round in &self.rounds {
            for guess in self.guesses(round, seen) {
                self.starts(round, &guess, seen, &mut starts);
            }
        }
        starts.sort_by_key(|s: &(Plane, Vec<Match>)| std::cmp::Reverse(s.1.len()));
        let mut choices: Vec<Choice> = Vec::new();
        for (plane, matches) in starts.into_iter().take(MOST) {
            let choice = self.settle(plane, matches, seen, window);
            if !choices.iter().any(|c| same(&c.matches, &choice.matches)) {
                choices.push(choice);
            }
        }
        choices.sort_by(|a, b| b.worth.score.total_cmp(&a.worth.score));
        choices
    }

    fn guesses(&self, round: &Round, seen: &[Seen]) -> Vec<Guess> {
        let anchors = &seen[..seen.len().min(self.options.anchors)];
        let cosine = (3.0 * self.options.tilt_sd_rad).min(0.6).cos();
        let allowed = Allowed { scale: 2.5 * self.options.scale_sd, cosine };
        let least = if round.wires.len() >= 4 { 3 } else { 2 };
        let mut search =
            Search { places: &round.places, seen: anchors, allowed, least, guesses: Vec::new(), most: 0 };
        search.run();
        // A sliding wire can make up for two parallel ones that were not found.
        let most = search.most;
        search.guesses.retain(|g| g.hits.len() + 2 >= most);
        search.guesses
    }

    /// The planes a guess may stand for: where the dots of sliding wires put it, tilted one way or the other.
    fn starts(&self, round: &Round, guess: &Guess, seen: &[Seen], into: &mut Vec<(Plane, Vec<Match>)>) {
        let hits: Vec<Match> = guess.hits.iter().map(|&(dot, place)| (dot, round.wires[place])).collect();
        let (down, sine) = guess.lay.tilt();
        let sine = sine.min(STEEP);
        if let Some(z) = round.z {
            into.push((raised(&guess.lay, Vector2::zeros(), z), hits));
            return;
        }
        let votes = self.votes(&guess.lay, &hits, seen);
        for mut agreed in agreements(&votes, seen) {
            for slope in if sine > 0.12 { vec![down * sine, -down * sine] } else { vec![Vector2::zeros()] } {
                let z = self.middle(&agreed, slope, seen);
                let mut matches = hits.clone();
                matches.extend(agreed.iter().map(|v| (v.dot, v.wire)));
                into.push((raised(&guess.lay, slope, z), matches));
            }
            agreed.clear();
        }
    }

    fn votes(&self, lay: &Lay, hits: &[Match], seen: &[Seen]) -> Vec<Vote> {
        let mut votes = Vec::new();
        for (dot, s) in seen.iter().enumerate().filter(|(dot, _)| !hits.iter().any(|h| h.0 == *dot)) {
            for (wire, strand) in self.section.strands.iter().enumerate() {
                let Some((z, off)) = strand.slid_to(lay.place(s.at)) else { continue };
                if off < self.options.gate_m && strand.reaches(z, 2e-3) {
                    votes.push(Vote { dot, wire, z, off });
                }
            }
        }
        votes
    }

    /// Where along the phantom the image's first pixel is, by the dots of sliding wires; the middle without any.
    fn middle(&self, agreed: &[Vote], slope: Vector2<f64>, seen: &[Seen]) -> f64 {
        let mut at: Vec<f64> = agreed.iter().map(|v| v.z - slope.dot(&seen[v.dot].at)).collect();
        at.sort_by(f64::total_cmp);
        at.get(at.len() / 2).copied().unwrap_or((self.section.reach.0 + self.section.reach.1) / 2.0)
    }

    /// Refines a plane and its dots in turn until both stay.
    pub(super) fn settle(
        &self,
        mut plane: Plane,
        matches: Vec<Match>,
        seen: &[Seen],
        window: &Window,
    ) -> Choice {
        let section = &self.section;
        plane.refine(section, seen, &matches, &self.belief, 4);
        let mut matches = assign(&plane, section, seen, self.options.gate_m);
        for _ in 0..4 {
            plane.refine(section, seen, &matches, &self.belief, 3);
            let again = assign(&plane, section, seen, self.options.gate_m);
            if again == matches {
                break;
            }
            matches = again;
        }
        let worth = worth(&plane, section, seen, &matches, &self.belief, window);
        Choice { plane, matches, worth }
    }
}

fn same(a: &[Match], b: &[Match]) -> bool {
    a.len() == b.len() && a.iter().all(|m| b.contains(m))
}

/// A dot that may be a sliding wire's, and where along the phantom that puts it.
#[derive(Clone, Copy, Debug)]
struct Vote {
    dot: usize,
    wire: usize,
    z: f64,
    off: f64,
}

/// The two largest groups of votes that one plane may hold; one empty group without any votes.
fn agreements(votes: &[Vote], seen: &[Seen]) -> Vec<Vec<Vote>> {
    let mut groups: Vec<Vec<Vote>> = votes.iter().map(|v| agreeing(v, votes, seen)).collect();
    groups.sort_by(|a, b| b.len().cmp(&a.len()).then(spread(a).total_cmp(&spread(b))));
    let mut kept: Vec<Vec<Vote>> = Vec::new();
    for group in groups {
        let ids = |g: &[Vote]| g.iter().map(|v| (v.dot, v.wire)).collect::<Vec<_>>();
        if !kept.iter().any(|k| same(&ids(k), &ids(&group))) {
            kept.push(group);
        }
        if kept.len() == 3 {
            break;
        }
    }
    if kept.is_empty() { vec![Vec::new()] } else { kept }
}

fn agreeing(with: &Vote, votes: &[Vote], seen: &[Seen]) -> Vec<Vote> {
    let far = |v: &Vote| AGREE_M + STEEP * (seen[v.dot].at - seen[with.dot].at).norm();
    let near = |v: &&Vote| (v.z - with.z).abs() < far(v) && v.wire != with.wire && v.dot != with.dot;
    let mut sorted: Vec<Vote> = votes.iter().filter(near).copied().collect();
    sorted.sort_by(|a, b| cost(a, with).total_cmp(&cost(b, with)));
    let mut group = vec![*with];
    for vote in sorted {
        if !group.iter().any(|g| g.wire == vote.wire || g.dot == vote.dot) {
            group.push(vote);
        }
    }
    group
}

fn cost(vote: &Vote, with: &Vote) -> f64 {
    vote.off + (vote.z - with.z).abs() / 3.0
}

fn spread(group: &[Vote]) -> f64 {
    group.iter().map(|v| cost(v, &group[0])).sum()
}

/// The plane of a lay that rises along the phantom by `slope`, at `z` at the image's origin.
fn raised(lay: &Lay, slope: Vector2<f64>, z: f64) -> Plane {
    let long = lay.stretches().0.max(1e-6);
    let column =
        |i: usize| Vector3::new(lay.linear[(0, i)] / long, lay.linear[(1, i)] / long, slope[i]).normalize();
    let x = column(0);
    let y = (column(1) - x * x.dot(&column(1))).normalize();
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
    Plane { turn, origin: Vector3::new(lay.offset.x, lay.offset.y, z), stretch: Vector2::zeros() }
}
