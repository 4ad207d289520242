use std::sync::Arc;

use probepath_robot::Operator;
use probepath_sim::CellConfig;

use super::*;
use crate::protocol::Protocol;
use crate::session::{CellFile, Opening};

fn session(name: &str) -> Session {
    let out = std::env::temp_dir().join(format!("probepath-visit-{name}-{}", std::process::id()));
    Session::open(Opening {
        cell: CellFile { simulated: CellConfig::wire_phantom(), ..CellFile::default() },
        seed: 1,
        out,
        protocol: Protocol { name: "test".into(), text: String::new() },
        date: None,
        operator: Operator::new(),
        progress: Arc::new(()),
    })
    .unwrap()
}

#[test]
fn the_arm_visits_the_phantom_and_every_image_has_its_pose() {
    let mut session = session("whole");
    let located = session.phantom_as_measured().unwrap();
    let options = VisitOptions { clearance_m: 12e-3, ..VisitOptions::default() };
    let t = std::time::Instant::now();
    let plan = session.plan_calibration(&located, &options).unwrap();
    eprintln!("{:?} {} {}", t.elapsed(), plan.plan.expected, plan.plan.refused);
    for p in &plan.plan.expected.parameters { eprintln!("{p:?}"); }
    let t = std::time::Instant::now();
    let images = session.visit(&plan.stops, &VisitWish::default()).unwrap();
    eprintln!("{:?} {} images {:?}", t.elapsed(), images.shots.shots().len(), images.counts);
    eprintln!("now {}", session.now);
    let others = session.visit(&plan.others, &VisitWish::default()).unwrap();
    let t = std::time::Instant::now();
    let calibrated = session.calibrate(&images, &Default::default()).unwrap();
    eprintln!("calibrate {:?} notes {:?}", t.elapsed(), calibrated.spatial.notes);
    let calibrated = session.check_calibration(&calibrated, &others).unwrap();
    eprintln!("{:?} {:?}", calibrated.standard_error_m(), calibrated.spatial.fit.lag);
    eprintln!("{}", calibrated.checked.unwrap());
    eprintln!("{:?}", session.calibration_error(&calibrated));
    eprintln!("weak {:?}", calibrated.spatial.fit.weak);
}
