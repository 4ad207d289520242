use probepath_us_capture::phantom::Wire;

use super::*;
use crate::{CellConfig, CellError, SubjectConfig};

fn tank(config: &WirePhantomConfig, seed: u64) -> WireTank {
    WireTank::new(config, seed).unwrap()
}

/// Every shipped phantom, as it stands by default.
fn shipped() -> impl Iterator<Item = WirePhantomConfig> {
    WirePhantom::shipped_names()
        .map(|name| WirePhantomConfig { phantom: name.into(), ..WirePhantomConfig::default() })
}

#[test]
fn every_shipped_phantom_stands_upright_in_its_water() {
    for config in shipped() {
        let tank =
            tank(&WirePhantomConfig { place_error_mm: 0.0, place_error_deg: 0.0, ..config.clone() }, 3);
        let up = if config.phantom == "ical-3n" { Vector3::y() } else { Vector3::z() };
        let up = tank.world_from_phantom().isometry().rotation * up;
        assert!((up + Vector3::y()).norm() < 1e-9, "{}: {up}", config.phantom);
        let ends: Vec<_> = tank.strands().iter().flat_map(|strand| strand.ends).map(|p| p.vector()).collect();
        let middle = ends.iter().sum::<Vector3<f64>>() / ends.len() as f64;
        assert!(middle.x.abs() < 0.02 && middle.z.abs() < 0.02, "{}: {middle}", config.phantom);
        let lowest = ends.iter().map(|p| p.y).fold(f64::MIN, f64::max);
        assert!((lowest + 0.032).abs() < 0.5e-3, "{}: {lowest}", config.phantom);
        assert!(ends.iter().all(|p| p.y > tank.water_y() + 0.055), "{}", config.phantom);
    }
}

#[test]
fn holes_are_drilled_as_badly_as_said_and_wires_that_share_one_go_on_sharing() {
    let config = WirePhantomConfig::default();
    let drawn = config.phantom().unwrap();
    let (mut square, mut count) = (Vector3::zeros(), 0.0);
    for seed in 0..60 {
        let made = drilled(&drawn, &config, seed);
        let ends = |phantom: &WirePhantom| -> Vec<_> {
            phantom.wires.iter().flat_map(|Wire { front, back, .. }| [*front, *back]).collect()
        };
        let (before, after) = (ends(&drawn), ends(&made));
        for (a, b) in before.iter().zip(&after) {
            let off = b.vector() - a.vector();
            square += off.component_mul(&off);
            count += 1.0;
        }
        for i in 0..before.len() {
            for j in 0..i {
                let shared = before[i].distance(&before[j]) < 1e-9;
                assert_eq!(shared, after[i].distance(&after[j]) < 1e-9, "{i} {j}");
            }
        }
    }
    let deviation = (square / count).map(f64::sqrt) * 1e3;
    println!("{deviation:.4?} mm");
    assert!((deviation.x - 0.05).abs() < 0.002 && (deviation.z - 0.05).abs() < 0.002, "{deviation}");
    assert!(deviation.y < 1e-9, "along the wires, which are straight");
}

#[test]
fn it_stands_as_far_from_where_it_is_told_as_said() {
    let config = WirePhantomConfig::default();
    let told = Bench::new(&config).unwrap().world_from_phantom;
    for seed in 0..20 {
        let (metres, angle) = told.distance(tank(&config, seed).world_from_phantom());
        assert!((metres - 2e-3).abs() < 1e-9 && (angle - 1_f64.to_radians()).abs() < 1e-9);
    }
    assert_ne!(tank(&config, 1).world_from_phantom(), tank(&config, 2).world_from_phantom());
    assert_eq!(tank(&config, 1).strands(), tank(&config, 1).strands());
}

#[test]
fn the_faces_lie_on_the_solids_that_the_probe_meets() {
    for config in shipped() {
        let tank = tank(&config, 5);
        for (number, facet) in tank.facets().iter().enumerate() {
            let middle = facet.corner.vector() + (facet.edges[0] + facet.edges[1]) / 2.0;
            let (distance, _) = tank.surface(Point::from_vector(middle));
            assert!(
                distance.abs() < 1e-9 || (number < 2 && distance <= 0.0),
                "{} {number}: {distance}",
                config.phantom
            );
        }
        let over = tank.strands()[0].ends[0].vector() - Vector3::y() * 0.03;
        let (distance, up) = tank.surface(Point::from_vector(over));
        assert!(distance > 0.005 && up.vector().y < -0.5, "{distance} {up:?}");
    }
}

#[test]
fn a_phantom_is_named_or_written_out_and_anything_else_is_refused_with_what_ships() {
    let text = WirePhantom::shipped("fcal-1.2").unwrap().to_toml().unwrap();
    let inline = WirePhantomConfig { phantom: text, ..WirePhantomConfig::default() };
    assert_eq!(inline.phantom().unwrap(), WirePhantom::shipped("fcal-1.2").unwrap());
    let wrong = WirePhantomConfig { phantom: "nothing.toml".into(), ..WirePhantomConfig::default() };
    let refused = wrong.phantom().unwrap_err();
    assert!(matches!(&refused, CellError::Phantom { named, .. } if named == "nothing.toml"), "{refused}");
    assert!(refused.to_string().contains("z-19"), "{refused}");
}

#[test]
fn water_that_boils_and_an_up_without_length_are_refused_by_name() {
    let refused = |wires: WirePhantomConfig| {
        let config = CellConfig { subject: SubjectConfig::WirePhantom(wires), ..CellConfig::wire_phantom() };
        crate::SimulatedCell::new(&config, 1).unwrap_err().to_string()
    };
    let boils = refused(WirePhantomConfig { water_celsius: 101.0, ..WirePhantomConfig::default() });
    assert!(boils.contains("subject.wire_phantom.water_celsius is 101"), "{boils}");
    let flat = refused(WirePhantomConfig { up: Some([0.0; 3]), ..WirePhantomConfig::default() });
    assert!(flat.contains("subject.wire_phantom.up"), "{flat}");
}
