//! Guided by the hand.

use nalgebra::{SMatrix, Vector6};

use super::*;

/// The simplest software that gives way: a mass and a damper, in translation (kg, N s/m) and in rotation.
struct GivesWay {
    velocity: Vector6<f64>,
    mass: [f64; 2],
    damping: [f64; 2],
    fastest_m_s: f64,
}

impl Default for GivesWay {
    fn default() -> Self {
        Self { velocity: Vector6::zeros(), mass: [2.0, 0.02], damping: [90.0, 0.8], fastest_m_s: 0.1 }
    }
}

impl GivesWay {
    fn next(&mut self, cell: &SimulatedCell, state: &State) -> Joints {
        if !state.guiding {
            return state.commanded;
        }
        let nominal = cell.nominal();
        let pose = nominal.model().forward(&state.commanded) * nominal.flange_from_probe;
        let rotation = pose.isometry().rotation;
        let (force, torque) = (rotation * state.wrench.force, rotation * state.wrench.torque);
        let push = [force, torque];
        for (part, push) in push.iter().enumerate() {
            let mut velocity = self.velocity.fixed_rows::<3>(3 * part).into_owned();
            let tau = self.mass[part] / self.damping[part];
            velocity += (push / self.damping[part] - velocity) * (1.0 - (-0.002 / tau).exp());
            let fastest = if part == 0 { self.fastest_m_s } else { 1.0 };
            self.velocity.fixed_rows_mut::<3>(3 * part).copy_from(&velocity.cap_magnitude(fastest));
        }
        let jacobian = nominal.model().jacobian(&state.commanded, &nominal.flange_from_probe);
        let j = SMatrix::<f64, 6, 6>::from_fn(|row, column| jacobian.column(column)[row]);
        let rates = j.lu().solve(&self.velocity).expect("far from singular");
        let mut next = state.commanded;
        next.as_mut_slice().iter_mut().zip(rates.iter()).for_each(|(q, rate)| *q += rate * 0.002);
        next
    }
}

/// Guides until the hand lets go; gives the states.
fn guided(cell: &SimulatedCell) -> Vec<State> {
    guided_with(cell, GivesWay::default())
}

fn guided_with(cell: &SimulatedCell, mut software: GivesWay) -> Vec<State> {
    let mut arm = cell.arm();
    cell.hand().guide();
    let mut state = arm.exchange(&Command::Stay).unwrap();
    let mut states = vec![state];
    while cell.hand().guides() && states.len() < 90 * 500 {
        let next = software.next(cell, &state);
        state = arm.exchange(&Command::Position(next)).unwrap();
        states.push(state);
    }
    assert!(!cell.hand().guides(), "it never lets go");
    states
}

#[test]
fn the_hand_guides_the_arm_along_the_leg_as_a_person_would() {
    for seed in 1..=3 {
        let cell = SimulatedCell::new(&CellConfig::default(), seed).unwrap();
        let states = guided(&cell);
        let moments = cell.truth().moments();
        let on_skin: Vec<_> = moments.iter().filter(|m| m.skin.force.norm() > 0.5).collect();
        let z = |m: &Moment| m.world_from_probe.origin().vector().z;
        let (first, last) = (z(on_skin[0]), z(on_skin[on_skin.len() - 1]));
        let forces: Vec<f64> = on_skin.iter().map(|m| -m.skin.force.z).collect();
        let (mean, deviation) = mean_and_deviation(&forces);
        let most = forces.iter().copied().fold(0.0, f64::max);
        println!(
            "seed {seed}: {:.1} s, from z {:.0} mm to {:.0} mm; force {mean:.2} ± {deviation:.2} N, at most {most:.1} N",
            states.len() as f64 * 0.002,
            first * 1e3,
            last * 1e3
        );
        assert!(first > -0.02 && last < -0.19, "{first} {last}");
        assert!((3.0..6.0).contains(&mean) && most < 14.0, "{mean} {most}");
        off_the_artery(&cell, &on_skin);
        assert!(states.last().is_some_and(|s| !s.guiding) && states[10].guiding);
        assert!(moments.last().is_some_and(|m| m.skin.force.norm() == 0.0), "it ends in the air");
        lifts_and_turns_back(&on_skin);
    }
}

/// The artery stays under the probe: within a third of the picture's width of its middle.
fn off_the_artery(cell: &SimulatedCell, on_skin: &[&Moment]) {
    let main = cell.subject().main().unwrap();
    let aside: Vec<f64> = on_skin
        .iter()
        .step_by(50)
        .map(|m| {
            let centre = main.centre(main.nearest(m.world_from_probe.origin()));
            (m.world_from_probe.inverse() * centre).vector().x.abs()
        })
        .collect();
    let most = aside.iter().copied().fold(0.0, f64::max);
    println!(
        "  the artery is {:.1} mm aside in the mean, {:.1} mm at most",
        mean_and_deviation(&aside).0 * 1e3,
        most * 1e3
    );
    assert!(most < 0.0135, "{most}");
}

fn lifts_and_turns_back(on_skin: &[&Moment]) {
    let lifted = on_skin.windows(2).any(|w| (w[1].stamp - w[0].stamp).seconds() > 0.1);
    let mut lowest = 0.0f64;
    let mut back = 0.0f64;
    for moment in on_skin {
        let z = moment.world_from_probe.origin().vector().z;
        lowest = lowest.min(z);
        back = back.max(z - lowest);
    }
    println!("  lifted: {lifted}; turned back by {:.1} mm", back * 1e3);
    assert!(lifted && back > 0.003);
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_does_not() {
    let run = |seed| {
        let config = CellConfig {
            hand: HandConfig { length_mm: 30.0, ..HandConfig::default() },
            ..CellConfig::default()
        };
        let states = guided(&SimulatedCell::new(&config, seed).unwrap());
        format!("{states:?}")
    };
    let (a, b, c) = (run(7), run(7), run(8));
    assert!(a == b && a != c);
}

#[test]
fn a_hand_that_is_told_to_lets_go_at_once() {
    let cell = SimulatedCell::new(&CellConfig::default(), 1).unwrap();
    let mut arm = cell.arm();
    cell.hand().guide();
    assert!(arm.exchange(&Command::Stay).unwrap().guiding);
    cell.hand().let_go();
    let state = arm.exchange(&Command::Stay).unwrap();
    assert!(!state.guiding && cell.truth().now().hand.force.norm() == 0.0);
}

#[test]
fn software_that_gives_way_lightly_heavily_or_slowly_is_guided_all_the_same() {
    for (mass, damping, fastest_m_s) in
        [(5.0, 40.0, 0.1), (10.0, 100.0, 0.1), (3.0, 300.0, 0.1), (2.0, 80.0, 0.02)]
    {
        let software = GivesWay {
            mass: [mass, 0.01 * mass],
            damping: [damping, 0.01 * damping],
            fastest_m_s,
            ..GivesWay::default()
        };
        let config = CellConfig {
            hand: HandConfig { length_mm: 70.0, ..HandConfig::default() },
            ..CellConfig::default()
        };
        let cell = SimulatedCell::new(&config, 5).unwrap();
        guided_with(&cell, software);
        let moments = cell.truth().moments();
        let on_skin: Vec<_> = moments.iter().filter(|m| m.skin.force.norm() > 0.5).collect();
        let lowest = on_skin.iter().map(|m| m.world_from_probe.origin().vector().z).fold(0.0, f64::min);
        let most = on_skin.iter().map(|m| -m.skin.force.z).fold(0.0, f64::max);
        assert!(lowest < -0.06 && most < 9.0, "{damping} N s/m: {lowest} m, {most} N");
    }
}
