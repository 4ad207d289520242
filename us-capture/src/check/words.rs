//! What a check found, in words.

use nalgebra::Vector3;

use super::{Change, CheckOptions, Misfit, Verdict};

/// Standard errors that make a difference worth a word.
const CLEAR: f64 = 3.0;

pub(super) fn told(verdict: Verdict, change: &Change, options: &CheckOptions) -> String {
    let said = match verdict {
        Verdict::Holds => holds(change, options),
        Verdict::CannotTell => cannot_tell(change, options),
        Verdict::Moved => format!("{}: calibrate again", moved(change, options).join("; ")),
    };
    let rows = rows(change, options).map(|rows| format!("; {rows}")).unwrap_or_default();
    said + &rows
}

/// It holds by the dots, not by the covariance.
pub(super) fn seen_only(change: &Change, misfit: &Misfit, options: &CheckOptions) -> String {
    let turned = misfit.turned_rad.to_degrees();
    let lag = match change.lag_s {
        Some((late, error)) if change.is_late(options) => {
            format!(" and the lag off by {:+.1} +- {:.1} ms", late * 1e3, error * 1e3)
        }
        _ => String::new(),
    };
    let rows = rows(change, options).map(|rows| format!("; {rows}")).unwrap_or_default();
    format!(
        "the calibration holds where the phantom was seen: the middle wires are off by {:.2} mm and all dots by {:.2} mm \
         from their wires (the scan's own fit: {:.2} and {:.2} mm; {:.2} mm more are allowed); beyond them this scan \
         cannot tell: its own fit has the worst point of the image {}{lag}, but the probe turned only \
         {turned:.0} degrees about two of its axes, so that errors of the whole recording may make that: tilt it by 15 degrees both ways to \
         check all of the image{rows}",
        misfit.mid.rms_m * 1e3,
        misfit.line.rms_m * 1e3,
        misfit.own_mid.rms_m * 1e3,
        misfit.own_line.rms_m * 1e3,
        options.tolerance_m * 1e3,
        worst(change)
    )
}

fn worst(change: &Change) -> String {
    format!("off by {:.2} +- {:.2} mm", change.worst_m * 1e3, change.worst_error_m * 1e3)
}

fn holds(change: &Change, options: &CheckOptions) -> String {
    let allowed = options.tolerance_m * 1e3;
    let lag = match change.lag_s {
        None => "the lag was not checked: the probe stood still for every image".into(),
        Some((_, error)) if CLEAR * error > 2.0 * options.lag_tolerance.seconds() => {
            let error = error * 1e3;
            format!("the lag is known to {error:.0} ms only: move the probe to and fro to check it")
        }
        Some((late, error)) => format!("the lag is off by {:+.1} +- {:.1} ms", late * 1e3, error * 1e3),
    };
    format!(
        "the calibration holds: the worst point of the image is {} ({allowed:.2} mm are allowed); {lag}",
        worst(change)
    )
}

fn cannot_tell(change: &Change, options: &CheckOptions) -> String {
    let water = match options.water_celsius {
        Some(_) => "",
        None => ", give the water's temperature",
    };
    format!(
        "this scan cannot tell: the worst point of the image is {}, and some point of it is known to {:.2} mm only; \
         scan longer, tilt the probe by 15 degrees both ways{water}",
        worst(change),
        change.blur_m * 1e3
    )
}

fn moved(change: &Change, options: &CheckOptions) -> Vec<String> {
    let mut said = Vec::new();
    if change.is_elsewhere(options) {
        let ways: Vec<String> = [shifted(change), turned(change)].into_iter().flatten().collect();
        let ways = if ways.is_empty() { String::new() } else { format!(": {}", ways.join(" and ")) };
        said.push(format!(
            "the image moved on the probe{ways}; its worst point is {}; the holder or the marker slipped, or the \
             phantom is not where it is said to stand",
            worst(change)
        ));
    }
    if let (true, Some((late, error))) = (change.is_late(options), change.lag_s) {
        said.push(format!(
            "the lag changed by {:+.1} +- {:.1} ms: the machine's setting, or the way its images come in, is another",
            late * 1e3,
            error * 1e3
        ));
    }
    said
}

fn shifted(change: &Change) -> Option<String> {
    let (axis, by) = clearest(&change.shift_m, &change.shift_error_m)?;
    Some(format!("its middle by {:+.2} mm along the probe's {axis}", by * 1e3))
}

fn turned(change: &Change) -> Option<String> {
    let (axis, by) = clearest(&change.turn_rad, &change.turn_error_rad)?;
    Some(format!("turned by {:+.2} degrees about the probe's {axis}", by.to_degrees()))
}

/// The largest of three numbers, when it is more than chance.
fn clearest(of: &Vector3<f64>, errors: &Vector3<f64>) -> Option<(&'static str, f64)> {
    let all = ["x", "y", "z"].into_iter().zip(of.iter().zip(errors.iter()));
    let clear = all.filter(|(_, (by, error))| by.abs() > CLEAR * **error);
    clear.max_by(|a, b| a.1.0.abs().total_cmp(&b.1.0.abs())).map(|(axis, (by, _))| (axis, *by))
}

/// What the rows' size says of the phantom's bath, when nobody measured that.
fn rows(change: &Change, options: &CheckOptions) -> Option<String> {
    let unasked = options.water_celsius.is_none() && (change.row_scale - 1.0).abs() > 0.01;
    unasked.then(|| {
        format!(
            "rows are {:.3} times as high as the calibration's: the phantom was taken to stand in water",
            change.row_scale
        )
    })
}
