//! Dots that are known: drawn, moved, cut.

mod honest;

use super::*;

/// An image of Gaussian dots (column, row, peak, spreads along columns and rows).
fn drawn(width: usize, height: usize, dots: &[[f64; 5]]) -> Vec<u8> {
    let level = |u: f64, v: f64| {
        let one =
            |d: &[f64; 5]| d[2] * (-0.5 * (((u - d[0]) / d[3]).powi(2) + ((v - d[1]) / d[4]).powi(2))).exp();
        dots.iter().map(one).fold(0.0, f64::max).round() as u8
    };
    (0..width * height).map(|at| level((at % width) as f64, (at / width) as f64)).collect()
}

#[test]
fn drawn_dots_are_found_where_they_were_drawn() {
    let truth =
        [[60.3, 40.8, 240.0, 5.0, 3.0], [200.7, 90.2, 150.0, 8.0, 3.0], [120.5, 150.1, 90.0, 3.0, 2.0]];
    let mut finder = DotFinder::new(DotSettings::default(), &Mask::whole(), 320, 200).unwrap();
    let dots = finder.find(&drawn(320, 200, &truth)).unwrap();
    assert_eq!(dots.len(), 3, "{dots:?}");
    for drawn in &truth {
        let off = |dot: &Dot| (dot.at_px[0] - drawn[0]).hypot(dot.at_px[1] - drawn[1]);
        assert!(dots.iter().any(|dot| off(dot) < 0.05 && !dot.cut), "{drawn:?}: {dots:?}");
    }
}

#[test]
fn an_image_of_another_size_is_refused() {
    let mut finder = DotFinder::new(DotSettings::default(), &Mask::whole(), 320, 200).unwrap();
    let refused = finder.find(&[0; 100]).unwrap_err();
    assert_eq!(refused, BadDots::Pixels { given: 100, width: 320, height: 200 });
}

#[test]
fn a_dot_outside_the_region_is_not_seen_and_one_on_its_edge_is_cut() {
    let image = drawn(320, 200, &[[60.0, 40.0, 240.0, 5.0, 3.0], [200.0, 90.0, 240.0, 5.0, 3.0]]);
    let mask = Mask::rectangle(100.0, 0.0, 102.0, 200.0).unwrap();
    let mut finder = DotFinder::new(DotSettings::default(), &mask, 320, 200).unwrap();
    let dots = finder.find(&image).unwrap();
    assert_eq!(dots.len(), 1, "{dots:?}");
    assert!(dots[0].cut && dots[0].at_px[0] > 190.0);
}
