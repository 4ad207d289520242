//! Time of one B-scan: the figure to stay under is 15 ms on two cores, so that a scan of 400 takes 6 s.

#![allow(missing_docs, reason = "criterion's macros make public items that nobody reads")]

use criterion::{Criterion, criterion_group, criterion_main};
use probepath_frames::nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Direction, Image, Point, Pose, World};
use probepath_sim::{
    Contact, ImagingConfig, Leg, LegConfig, PhantomConfig, Renderer, Tissue, VascularPhantom,
    WirePhantomConfig, WireTank, settings,
};
use probepath_us_capture::Setting;

/// The plane of a probe that stands on the skin, across a vessel that runs along z.
fn across(skin: Point<World>, outward: Direction<World>, setting: &Setting) -> Pose<World, Image> {
    let beam = -outward.vector();
    let row = beam.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[row, beam, row.cross(&beam)]);
    let corner = skin.vector() - row * (setting.window_width_m / 2.0) + beam * setting.window_top_m;
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    // FRAMES: x along the row, y along the beam, from the first pixel's centre, all written in the World.
    Pose::assume(Isometry3::from_parts(Translation3::from(corner), turn))
}

fn bench(c: &mut Criterion) {
    let Ok(renderer) = Renderer::new(ImagingConfig::default(), 1) else { return };
    let phantom = VascularPhantom::new(&PhantomConfig::default());
    let leg = Leg::new(&LegConfig::default(), 1);
    let (over_leg, normal) = leg.skin_over(leg.bifurcation_m() + 0.02);
    let over_phantom = Point::new(0.0, phantom.top_y(), 0.0);
    let up = Direction::y().reversed();
    let mut measure = |name: &str, tissue: &dyn Tissue, setting: Setting, skin, outward| {
        let at = across(skin, outward, &setting);
        let mut number = 0;
        c.bench_function(name, |b| {
            b.iter(|| {
                number += 1;
                renderer.render(tissue, &at, &setting, Contact::Full, number)
            });
        });
    };
    let zoom = settings::zoomed(0.07, 0.045, 0.03, 0.034);
    measure("phantom_zoom_3_7", &phantom, zoom, over_phantom, up);
    measure("leg_depth_5_cm", &leg, settings::whole_depth(0.05, 0.030), over_leg, normal);
    measure("leg_depth_7_cm", &leg, settings::whole_depth(0.07, 0.045), over_leg, normal);
    let Ok(tank) = WireTank::new(&WirePhantomConfig::default(), 1) else { return };
    // Between the plates, and where the beam grazes one of them and meets the bottom.
    let over = |z: f64| Point::new(0.0, tank.water_y() + 0.045, z);
    measure("wires_depth_7_cm", &tank, settings::whole_depth(0.07, 0.045), over(0.0), up);
    measure("wires_near_a_plate_depth_8_cm", &tank, settings::whole_depth(0.08, 0.045), over(0.027), up);
}

criterion_group!(benches, bench);
criterion_main!(benches);
