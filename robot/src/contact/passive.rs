//! The law on a thousand random skins, each a spring and a damper that give back no more than they were given, behind a
//! thousand arms: what is handed to the skin stays bounded, and everything comes to rest.

use probepath_frames::Span;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::{ContactLaw, ContactSettings};

const DT: f64 = 0.002;
const SET: f64 = 5.0;

fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// A skin that stands still, an arm with a servo of second order and play in its gears, a sensor that is late.
struct Bench {
    stiffness: f64,
    damping: f64,
    lag: f64,
    play: f64,
    noise: f64,
    /// Commands and forces on their way.
    told: [f64; 3],
    felt: Vec<f64>,
    servo: [f64; 2],
    at: f64,
    rng: ChaCha8Rng,
}

impl Bench {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let late = 1 + (between(&mut rng, 0.0, 3.0) as usize);
        Self {
            stiffness: 300.0 * 10f64.powf(between(&mut rng, 0.0, 1.0)),
            damping: between(&mut rng, 0.0, 20.0),
            lag: between(&mut rng, 0.006, 0.014),
            play: between(&mut rng, 0.0, 15e-6),
            noise: between(&mut rng, 0.0, 0.1),
            told: [0.0; 3],
            felt: vec![0.0; late],
            servo: [0.0; 2],
            at: 0.0,
            rng,
        }
    }

    /// One tick: the force that is felt (N), and the energy handed to the skin beyond the set force's own work (J).
    fn step(&mut self, offset: f64) -> (f64, f64) {
        self.told = [offset, self.told[0], self.told[1]];
        let share = 1.0 - (-2.0 * DT / self.lag).exp();
        self.servo[0] += share * (self.told[1] - self.servo[0]);
        self.servo[1] += share * (self.servo[0] - self.servo[1]);
        let before = self.at;
        self.at = self.at.clamp(self.servo[1] - self.play, self.servo[1] + self.play);
        let moved = self.at - before;
        let force = (self.stiffness * self.at + self.damping * moved / DT).max(0.0);
        self.felt.push(force);
        (force, (force - SET) * moved)
    }

    fn read(&mut self) -> f64 {
        let noise = (0..12).map(|_| between(&mut self.rng, 0.0, 1.0)).sum::<f64>() - 6.0;
        self.felt.remove(0) + self.noise * noise
    }
}

/// Energy handed over at most (J), and the force's deviation over the last second (N), its noise's share left in.
fn pushed(seed: u64, kick: f64) -> (f64, f64) {
    let mut bench = Bench::new(seed);
    let mut law = ContactLaw::new(ContactSettings::default(), Span::from_milliseconds(2)).unwrap();
    let (mut handed, mut most, mut squares) = (0.0_f64, 0.0_f64, 0.0);
    for tick in 0..5000 {
        // Half a second in, somebody pushes against the probe for a tenth of one: the sensor feels what no skin gave.
        let push = if (250..300).contains(&tick) { kick } else { 0.0 };
        let measured = bench.read() + push;
        let (force, energy) = bench.step(law.step(measured, SET));
        // From the push on: before, the force was raised to the set one, which is work well spent.
        if tick >= 250 {
            handed += energy;
            most = most.max(handed);
        }
        if tick >= 4500 {
            squares += (force - SET).powi(2);
        }
    }
    (most, f64::sqrt(squares / 500.0))
}

#[test]
fn a_thousand_random_skins_are_handed_a_bounded_energy_and_all_come_to_rest() {
    let (mut energy, mut unrest) = (0.0_f64, 0.0_f64);
    for seed in 0..1000 {
        let (handed, left) = pushed(seed, if seed % 2 == 0 { 4.0 } else { -4.0 });
        energy = energy.max(handed);
        unrest = unrest.max(left);
    }
    println!("handed over {:.2} mJ at most, {unrest:.3} N RMS in the last second at most", energy * 1e3);
    assert!(unrest <= 0.15, "{unrest} N: a limit cycle");
    assert!(energy <= 0.02, "{energy} J");
}

#[test]
fn far_stiffer_than_any_skin_and_behind_an_arm_far_too_slow_it_is_calmed() {
    let mut most = 0.0_f64;
    for seed in 0..100 {
        let mut bench = Bench { stiffness: 5000.0, lag: 0.02, ..Bench::new(seed) };
        let mut law = ContactLaw::new(ContactSettings::default(), Span::from_milliseconds(2)).unwrap();
        let mut squares = 0.0;
        for tick in 0..5000 {
            let measured = bench.read();
            let (force, _) = bench.step(law.step(measured, SET));
            squares += if tick >= 4000 { (force - SET).powi(2) } else { 0.0 };
        }
        most = most.max(f64::sqrt(squares / 1000.0));
    }
    println!("far too stiff: {most:.3} N RMS in the last two seconds at most");
    assert!(most <= 1.5, "{most} N");
}
