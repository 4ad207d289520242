//! The steps of a calibration: each translates its options and takes the session's step.

use std::sync::Arc;

use probepath_us_capture::plan::VisitOptions;
use rhai::{Engine, Map, NativeCallContext};

use super::Stage;
use super::steps::{Outcome, wrong};
use crate::options::Options;
use crate::quantity::{Angle, Duration, Length, Speed, Temperature};
use crate::session::{CalibrateWish, Calibrated, CalibrationPlan, Located, PhantomImages, VisitWish, Visits};

/// How each step is written, for messages.
pub(super) const USAGE: &[(&str, &str)] = &[
    ("locate_phantom", "locate_phantom() or locate_phantom(#{ touches: 10 })"),
    ("calibration_plan", "calibration_plan(phantom, #{ poses: 24, held_out: 12, tilt: degrees(18) })"),
    ("visit", "visit(plan.stops, #{ speed: mm_s(50), settle: seconds(0.3), look: seconds(0.12) })"),
    ("calibrate", "calibrate(images) or calibrate(images, #{ water: celsius(20) })"),
    ("check", "check(calibration, others)"),
];

/// Registers every step.
pub(super) fn register(engine: &mut Engine, stage: &Stage) {
    plans(engine, stage);
    visits(engine, stage);
    calibrations(engine, stage);
}

fn plans(engine: &mut Engine, stage: &Stage) {
    engine.register_type_with_name::<Arc<Located>>("Phantom");
    engine.register_type_with_name::<Arc<CalibrationPlan>>("CalibrationPlan");
    engine.register_get("expected", |plan: &mut Arc<CalibrationPlan>| {
        Length::from_si(plan.plan.expected.point_mean_m)
    });
    engine.register_get("expected_p95", |plan: &mut Arc<CalibrationPlan>| {
        Length::from_si(plan.plan.expected.point_p95_m)
    });
    engine.register_get("stops", |plan: &mut Arc<CalibrationPlan>| Arc::new(plan.stops.clone()));
    engine.register_get("others", |plan: &mut Arc<CalibrationPlan>| Arc::new(plan.others.clone()));
    let s = stage.clone();
    engine.register_fn("locate_phantom", move |context: NativeCallContext| -> Outcome<Arc<Located>> {
        s.step(&context, |session| session.phantom_as_measured()).map(Arc::new)
    });
    let s = stage.clone();
    engine.register_fn(
        "locate_phantom",
        move |context: NativeCallContext, map: Map| -> Outcome<Arc<Located>> {
            let mut options = Options::new("locate_phantom", map);
            let touches = options.count("touches").map_err(|e| wrong(&context, e))?;
            options.done().map_err(|e| wrong(&context, e))?;
            s.step(&context, |session| match touches {
                Some(postures) => session.phantom_by_touch(postures),
                None => session.phantom_as_measured(),
            })
            .map(Arc::new)
        },
    );
    let s = stage.clone();
    engine.register_fn(
        "calibration_plan",
        move |context: NativeCallContext, located: Arc<Located>, map: Map| -> Outcome<Arc<CalibrationPlan>> {
            let options = visit_options(map).map_err(|e| wrong(&context, e))?;
            s.step(&context, |session| session.plan_calibration(&located, &options)).map(Arc::new)
        },
    );
}

fn visits(engine: &mut Engine, stage: &Stage) {
    engine.register_type_with_name::<Arc<Visits>>("Stops");
    engine.register_type_with_name::<Arc<PhantomImages>>("PhantomImages");
    engine.register_get("count", |images: &mut Arc<PhantomImages>| images.shots.shots().len() as rhai::INT);
    let s = stage.clone();
    engine.register_fn(
        "visit",
        move |context: NativeCallContext, stops: Arc<Visits>, map: Map| -> Outcome<Arc<PhantomImages>> {
            let wish = visit_wish(map).map_err(|e| wrong(&context, e))?;
            s.step(&context, |session| session.visit(&stops, &wish)).map(Arc::new)
        },
    );
}

fn calibrations(engine: &mut Engine, stage: &Stage) {
    engine.register_type_with_name::<Arc<Calibrated>>("Calibration");
    engine.register_get("standard_error", |calibrated: &mut Arc<Calibrated>| {
        Length::from_si(calibrated.standard_error().mean_m)
    });
    engine.register_get("mid_rms", |calibrated: &mut Arc<Calibrated>| {
        Length::from_si(calibrated.found().mid_rms_mm * 1e-3)
    });
    let s = stage.clone();
    engine.register_fn(
        "calibrate",
        move |context: NativeCallContext, images: Arc<PhantomImages>| -> Outcome<Arc<Calibrated>> {
            s.step(&context, |session| session.calibrate(&images, &CalibrateWish::default())).map(Arc::new)
        },
    );
    let s = stage.clone();
    engine.register_fn(
        "calibrate",
        move |context: NativeCallContext, images: Arc<PhantomImages>, map: Map| -> Outcome<Arc<Calibrated>> {
            let wish = calibrate_wish(map).map_err(|e| wrong(&context, e))?;
            s.step(&context, |session| session.calibrate(&images, &wish)).map(Arc::new)
        },
    );
    let s = stage.clone();
    engine.register_fn(
        "check",
        move |context: NativeCallContext,
              calibrated: Arc<Calibrated>,
              others: Arc<PhantomImages>|
              -> Outcome<Arc<Calibrated>> {
            s.step(&context, |session| session.check_calibration(&calibrated, &others)).map(Arc::new)
        },
    );
    let s = stage.clone();
    engine.register_fn(
        "save",
        move |context: NativeCallContext, calibrated: Arc<Calibrated>, name: &str| -> Outcome<()> {
            s.step(&context, |session| session.save_calibration(&calibrated, name))
        },
    );
}

fn visit_options(map: Map) -> Result<VisitOptions, String> {
    let mut options = Options::new("calibration_plan", map);
    let mut wish = VisitOptions::default();
    let set = |to: &mut f64, from: Option<f64>| from.into_iter().for_each(|value| *to = value);
    for (key, to) in [
        ("poses", &mut wish.poses),
        ("held_out", &mut wish.held_out),
        ("wires", &mut wish.least_wires),
        ("sweeps", &mut wish.sweep.count),
    ] {
        if let Some(count) = options.count(key)? {
            *to = count;
        }
    }
    set(&mut wish.tilt_rad, options.quantity::<Angle>("tilt")?.map(Angle::si));
    set(&mut wish.turn_rad, options.quantity::<Angle>("turn")?.map(Angle::si));
    set(&mut wish.clearance_m, options.quantity::<Length>("above")?.map(Length::si));
    set(&mut wish.highest_m, options.quantity::<Length>("at_most_above")?.map(Length::si));
    set(&mut wish.sweep.speed_m_s, options.quantity::<Speed>("sweep_speed")?.map(Speed::si));
    options.done()?;
    Ok(wish)
}

fn visit_wish(map: Map) -> Result<VisitWish, String> {
    let mut options = Options::new("visit", map);
    let usual = VisitWish::default();
    let wish = VisitWish {
        speed_m_s: options.quantity::<Speed>("speed")?.map_or(usual.speed_m_s, Speed::si),
        settle_s: options.quantity::<Duration>("settle")?.map_or(usual.settle_s, Duration::si),
        look_s: options.quantity::<Duration>("look")?.map_or(usual.look_s, Duration::si),
    };
    options.done()?;
    Ok(wish)
}

fn calibrate_wish(map: Map) -> Result<CalibrateWish, String> {
    let mut options = Options::new("calibrate", map);
    let water_celsius = options.quantity::<Temperature>("water")?.map(Temperature::si);
    options.done()?;
    Ok(CalibrateWish { water_celsius })
}
