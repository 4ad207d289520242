use super::*;
use crate::phantom_images::Dice;

/// A helix of 40 mm radius that rises 100 mm in a quarter turn.
fn helix(t: f64) -> Vector3<f64> {
    let angle = t * std::f64::consts::FRAC_PI_2;
    Vector3::new(0.04 * angle.cos(), 0.04 * angle.sin(), 0.1 * t)
}

#[test]
fn a_curve_through_noisy_centres_is_near_the_true_one_and_as_long() {
    let mut dice = Dice(11);
    for case in 0..20 {
        let mut centres: Vec<Vector3<f64>> = (0..=200)
            .map(|i| {
                let ((a, b), (c, _)) = (dice.normal_pair(), dice.normal_pair());
                helix(f64::from(i) / 200.0) + Vector3::new(a, b, c) * 0.1e-3
            })
            .collect();
        centres[77] += Vector3::new(0.0, 0.02, 0.0);
        let line = Centreline::through(&centres).expect("long enough");
        let exact = (0.04_f64 * std::f64::consts::FRAC_PI_2).hypot(0.1);
        assert!((line.length_m() - exact).abs() < 0.5e-3, "{case}: {} {exact}", line.length_m());
        for i in 0..=100 {
            let true_place = helix(f64::from(i) / 100.0);
            let near = line.nearest(&true_place).expect("not empty");
            assert!((near.point.vector() - true_place).norm() < 0.25e-3, "{case} {i}");
        }
    }
}

#[test]
fn a_place_is_in_the_section_normal_to_the_curve() {
    let centres: Vec<Vector3<f64>> = (0..=200).map(|i| helix(f64::from(i) / 200.0)).collect();
    let line = Centreline::through(&centres).expect("long enough");
    let middle = line.at(0.05).expect("inside");
    let place = middle.point.vector() + middle.up.vector() * 0.004 + middle.side.vector() * 0.003;
    let found = line.at(line.foot(&place, 0.047).expect("found")).expect("inside");
    assert!((found.at_m - 0.05).abs() < 2e-6, "{}", found.at_m);
    let (at, up, side) = line.across(&place, 0.047).expect("found");
    assert!((at - found.at_m).abs() < 1e-12 && (up - 0.004).abs() < 1e-7 && (side - 0.003).abs() < 1e-7);
    assert!(middle.up.vector().dot(&middle.tangent.vector()).abs() < 1e-12);
}

#[test]
fn centres_in_one_place_have_no_line() {
    let same = vec![Vector3::new(1.0, 2.0, 3.0); 9];
    assert!(matches!(Centreline::through(&same), Err(ReconError::NoLength { .. })));
    assert!(Centreline::through(&[]).is_err());
}
