//! `calibrate …`: what was typed, brought to the room that does it.

use probepath_scripts::offline::calibrate::{
    self, CheckRequest, SpatialRequest, SubjectRequest, TemporalRequest,
};

use super::{Outcome, today};
use crate::cli::{Calibrate, Check, Spatial, Subject, Temporal};
use crate::screen::{Document, Screen};

/// Does what was typed.
///
/// # Errors
/// Whatever went wrong with it.
pub fn perform(which: Calibrate, screen: &Screen) -> Outcome {
    match which {
        Calibrate::Spatial(args) => spatial(*args, screen),
        Calibrate::Temporal(args) => temporal(args, screen),
        Calibrate::Check(args) => check(*args, screen),
    }
}

fn spatial(args: Spatial, screen: &Screen) -> Outcome {
    let request = SpatialRequest {
        sequence: args.sequence,
        subject: subject(args.subject),
        validate: args.validate,
        overlay: args.overlay,
        out: args.out,
        dots: args.dots,
        phantom_to_reference: args.phantom_to_reference,
        place: args.place,
        pixel_mm: args.pixel_mm,
        scale: args.scale,
        water_celsius: args.water_celsius,
        nominal: args.nominal,
        any_side: args.any_side,
        lag_s: args.lag_s,
        dynamic_range_db: args.dynamic_range_db,
        date: today(),
    };
    Ok(Document::of(&calibrate::spatial(&request, &*screen.progress())?)?)
}

fn temporal(args: Temporal, screen: &Screen) -> Outcome {
    let request = TemporalRequest {
        images: args.images,
        poses_file: args.poses_file,
        poses: args.poses,
        orientation: args.orientation,
    };
    Ok(Document::of(&calibrate::temporal(&request, &*screen.progress())?)?)
}

fn check(args: Check, screen: &Screen) -> Outcome {
    let request = CheckRequest {
        calibration: args.calibration,
        sequence: args.sequence,
        subject: subject(args.subject),
        phantom_to_reference: args.phantom_to_reference,
        water_celsius: args.water_celsius,
    };
    Ok(Document::of(&calibrate::check(&request, &*screen.progress())?)?)
}

fn subject(args: Subject) -> SubjectRequest {
    let Subject { phantom, poses, region, fan, orientation } = args;
    SubjectRequest { phantom, poses, region, fan, orientation }
}
