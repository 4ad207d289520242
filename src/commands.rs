//! Each command: what was typed, brought to the room that does it.

mod calibrate;
mod simulate;

use std::error::Error;

use probepath_scripts::session::{ArmRequest, MeasureRequest};
use probepath_scripts::{Operator, ScanRequest, offline, validate};

use crate::cli::{Command, FitOf, Goal, Unit};
use crate::screen::{Document, Screen};

type Outcome = Result<Document, Box<dyn Error>>;

/// Does what was typed.
///
/// # Errors
/// Whatever the work's room says went wrong.
pub fn perform(command: Command, screen: &Screen) -> Outcome {
    let document = match command {
        Command::Scan(args) => return scan(args, screen),
        Command::Calibrate(which) => return calibrate::perform(which, screen),
        Command::Reconstruct(args) => return reconstruct(args, screen),
        Command::Compare(args) => match &args.follow_up {
            Some(later) => Document::of(&offline::followed_up(&args.surface, later)?),
            None => Document::of(&offline::compare(&compared(args))?),
        },
        Command::Convert(args) => {
            Document::of(&offline::convert(&args.input, &args.output, args.no_burned_in)?)
        }
        Command::Simulate(args) => return simulate::perform(args, screen),
        Command::Arm(args) => return arm(args, screen),
        Command::Validate(args) => return validated(&args, screen),
    };
    Ok(document?)
}

fn compared(args: crate::cli::Compare) -> offline::CompareWish {
    let crate::cli::Compare { surface, gold, fit, in_place, gold_unit, out, .. } = args;
    // The command line asks for one of gold and follow_up.
    let gold = gold.unwrap_or_default();
    let fit = match fit {
        _ if in_place => offline::Fit::None,
        FitOf::Rigid => offline::Fit::Rigid,
        FitOf::Near => offline::Fit::Near,
        FitOf::Icp => offline::Fit::Icp,
        FitOf::None => offline::Fit::None,
    };
    let gold_unit_mm = match gold_unit {
        Unit::Mm => 1.0,
        Unit::Cm => 10.0,
        Unit::M => 1000.0,
    };
    offline::CompareWish { surface, gold, fit, gold_unit_mm, out }
}

fn arm(args: crate::cli::Arm, screen: &Screen) -> Outcome {
    let crate::cli::Arm { urdf, measure, cell, seconds, base, tip, joints_deg, flange_mm_deg, .. } = args;
    if args.identify_tool {
        let request = ArmRequest { address: urdf, cell };
        return Ok(Document::of(&request.identify_tool(
            args.out,
            &stopped_by_ctrl_c()?,
            screen.progress(),
        )?)?);
    }
    if args.recover {
        return Ok(Document::of(&ArmRequest { address: urdf, cell }.recover(&*screen.progress())?)?);
    }
    if measure {
        return Ok(Document::of(&MeasureRequest { address: urdf, cell, seconds }.run()?)?);
    }
    let urdf = urdf.unwrap_or_default();
    let question = offline::ArmQuestion { urdf, base, tip, joints_deg, flange_mm_deg };
    Ok(Document::of(&offline::arm(&question)?)?)
}

fn reconstruct(args: crate::cli::Reconstruct, screen: &Screen) -> Outcome {
    let crate::cli::Reconstruct { input, calibration, volume, volume_options, seed_mm, lumen, .. } = args;
    let lumen = lumen.map(|program| offline::FinderWish { program, seconds: args.lumen_seconds });
    let (volume_options, out) = (volume_options.into(), args.out);
    let wish = offline::ReconstructWish { input, calibration, volume, volume_options, seed_mm, lumen, out };
    Ok(Document::of(&offline::reconstruct(&wish, &*screen.progress())?)?)
}

/// Ctrl-C stops the arm.
fn stopped_by_ctrl_c() -> Result<Operator, ctrlc::Error> {
    let operator = Operator::new();
    let stopping = operator.clone();
    // A second Ctrl-C does nothing more: the first one already brakes the arm, and the exam has to be closed.
    ctrlc::set_handler(move || stopping.stop())?;
    Ok(operator)
}

fn scan(args: crate::cli::Scan, screen: &Screen) -> Outcome {
    let operator = stopped_by_ctrl_c()?;
    let crate::cli::Scan { protocol, cell, seed, out } = args;
    let request = ScanRequest { protocol, cell, seed, out, date: Some(today()) };
    Ok(Document::of(&request.run(&operator, screen.progress())?)?)
}

/// Today, as ISO 8601 has it: the one place where a command asks for the day.
fn today() -> String {
    jiff::Timestamp::now().strftime("%Y-%m-%d").to_string()
}

fn table2_wish(args: &crate::cli::Validate) -> validate::Table2Wish {
    let crate::cli::Validate { seeds, setting, jobs, keep, .. } = args;
    validate::Table2Wish { seeds: *seeds, setting: setting.clone(), jobs: *jobs, keep: keep.clone() }
}

fn validated(args: &crate::cli::Validate, screen: &Screen) -> Outcome {
    let (progress, seeds) = (screen.progress(), args.seeds);
    Ok(match args.goal {
        Goal::Table1 => Document::of(&validate::table1(seeds, args.setting.as_deref(), &*progress)?),
        Goal::Table2 => Document::of(&validate::table2(&table2_wish(args), &*progress)?),
        Goal::Speed => {
            Document::of(&validate::speed(args.setting.as_deref(), &std::env::current_exe()?, &*progress)?)
        }
        Goal::Force => Document::of(&validate::force(seeds, &*progress)?),
        Goal::Soak => {
            let wish = validate::SoakWish::wall(std::env::current_exe()?, args.minutes);
            Document::of(&validate::soak(&wish, &*progress)?)
        }
        Goal::Motion => Document::of(&validate::motion(seeds, &*progress)?),
        Goal::Safety => Document::of(&validate::safety(seeds, &std::env::current_exe()?, &*progress)?),
    }?)
}
