//! The steps a protocol may take. Each translates its options, takes the session's step, and puts the call's line and
//! column on whatever goes wrong.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use probepath_teach_replay::{Path, Side};
use rhai::{Array, Dynamic, Engine, EvalAltResult, Map, NativeCallContext};

use super::{Stage, lock};
use crate::options::Options;
use crate::quantity::{Force, Length, Speed};
use crate::session::{GuideBy, Lumen, ReportWish, Scan, ScanWish, Segment, Session, SessionError, TeachWish};

pub(super) type Outcome<T> = Result<T, Box<EvalAltResult>>;

/// How each step is written, for messages.
const USAGE: &[(&str, &str)] = &[
    (
        "teach",
        "teach(#{ study: \"LEG-007\", side: \"left\" }), or with by: \"freedrive\", stay_within: mm(1)",
    ),
    ("identify_tool", "identify_tool(): turns the probe in the air, and says what the arm carries"),
    ("load_path", "load_path(\"femoral.path.toml\")"),
    ("save", "path.save(\"femoral.path.toml\")"),
    ("trim", "path.trim(mm(10), mm(210))"),
    ("mirrored", "path.mirrored()"),
    ("scan", "scan(path, #{ speed: mm_s(10), force: newton(5), every: mm(0.5) })"),
    ("reconstruct", "reconstruct(images) or reconstruct(images, #{ seed_x: mm(20), seed_y: mm(30) })"),
    ("segment", "segment(\"CFA\", mm(0), mm(40))"),
    ("report", "report(lumen) or report(lumen, #{ segments: [segment(\"CFA\", mm(0), mm(40))] })"),
    ("warn", "warn(\"what the reader must know\")"),
];

/// How every step is written.
pub(super) fn usage() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    USAGE.iter().chain(super::stops::USAGE).chain(super::calibration::USAGE)
}

/// The steps' names, for messages.
pub(super) fn names() -> String {
    usage().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

/// A taught path in a script's hands.
type TaughtPath = Arc<Path>;

/// Registers every step.
pub(super) fn register(engine: &mut Engine, stage: &Stage) {
    paths(engine, stage);
    scans(engine, stage);
    reports(engine, stage);
}

fn paths(engine: &mut Engine, stage: &Stage) {
    let s = stage.clone();
    engine.register_fn("identify_tool", move |context: NativeCallContext| -> Outcome<()> {
        s.step(&context, Session::identify_tool).map(drop)
    });
    engine.register_type_with_name::<TaughtPath>("Path");
    engine.register_get("length", |path: &mut TaughtPath| Length::from_si(path.length()));
    let s = stage.clone();
    engine.register_fn("teach", move |context: NativeCallContext, map: Map| -> Outcome<TaughtPath> {
        let wish = teach_wish(map).map_err(|e| wrong(&context, e))?;
        s.step(&context, |session| session.teach(&wish)).map(Arc::new)
    });
    let s = stage.clone();
    engine.register_fn("load_path", move |context: NativeCallContext, name: &str| -> Outcome<TaughtPath> {
        s.step(&context, |session| session.load_path(name)).map(Arc::new)
    });
    let s = stage.clone();
    engine.register_fn(
        "save",
        move |context: NativeCallContext, path: TaughtPath, name: &str| -> Outcome<()> {
            s.step(&context, |session| session.save_path(&path, name))
        },
    );
    let s = stage.clone();
    engine.register_fn(
        "trim",
        move |context: NativeCallContext,
              path: TaughtPath,
              from: Length,
              until: Length|
              -> Outcome<TaughtPath> {
            s.step(&context, |session| session.trim(&path, from.si(), until.si())).map(Arc::new)
        },
    );
    let s = stage.clone();
    engine.register_fn(
        "mirrored",
        move |context: NativeCallContext, path: TaughtPath| -> Outcome<TaughtPath> {
            s.step(&context, |session| session.mirrored(&path)).map(Arc::new)
        },
    );
}

fn scans(engine: &mut Engine, stage: &Stage) {
    engine.register_type_with_name::<Arc<Scan>>("Scan");
    engine.register_get("kept", |scan: &mut Arc<Scan>| scan.images.len() as rhai::INT);
    let s = stage.clone();
    engine.register_fn(
        "scan",
        move |context: NativeCallContext, path: TaughtPath, map: Map| -> Outcome<Arc<Scan>> {
            let wish = scan_wish(map).map_err(|e| wrong(&context, e))?;
            s.step(&context, |session| session.scan(&path, &wish)).map(Arc::new)
        },
    );
    let s = stage.clone();
    engine.register_fn("scan", move |context: NativeCallContext, path: TaughtPath| -> Outcome<Arc<Scan>> {
        s.step(&context, |session| session.scan(&path, &ScanWish::default())).map(Arc::new)
    });
}

fn reports(engine: &mut Engine, stage: &Stage) {
    engine.register_type_with_name::<Arc<Lumen>>("Lumen");
    engine.register_type_with_name::<Segment>("Segment");
    let s = stage.clone();
    engine.register_fn(
        "reconstruct",
        move |context: NativeCallContext, scan: Arc<Scan>| -> Outcome<Arc<Lumen>> {
            s.step(&context, |session| session.reconstruct(&scan, None)).map(Arc::new)
        },
    );
    let s = stage.clone();
    engine.register_fn(
        "reconstruct",
        move |context: NativeCallContext, scan: Arc<Scan>, map: Map| -> Outcome<Arc<Lumen>> {
            let seed = seed(map).map_err(|e| wrong(&context, e))?;
            s.step(&context, |session| session.reconstruct(&scan, seed)).map(Arc::new)
        },
    );
    engine.register_fn("segment", |name: &str, from: Length, until: Length| Segment {
        name: name.to_owned(),
        from_m: from.si(),
        until_m: until.si(),
    });
    let s = stage.clone();
    engine.register_fn("report", move |context: NativeCallContext, lumen: Arc<Lumen>| -> Outcome<()> {
        s.step(&context, |session| session.report(&lumen, &ReportWish::default()))
    });
    let s = stage.clone();
    engine.register_fn(
        "report",
        move |context: NativeCallContext, lumen: Arc<Lumen>, map: Map| -> Outcome<()> {
            let wish = report_wish(map).map_err(|e| wrong(&context, e))?;
            s.step(&context, |session| session.report(&lumen, &wish))
        },
    );
    let s = stage.clone();
    engine.register_fn("warn", move |text: &str| lock(&s.session).warn(text));
}

impl Stage {
    /// Takes one step of the session; its error keeps its type, and the script ends at the call's place.
    pub(super) fn step<T>(
        &self,
        context: &NativeCallContext<'_>,
        step: impl FnOnce(&mut Session) -> Result<T, SessionError>,
    ) -> Outcome<T> {
        // What an earlier step met was caught by the script, and is no longer what ends it.
        *lock(&self.failed) = None;
        let mut session = lock(&self.session);
        step(&mut session).map_err(|error| {
            if error.is_stop() {
                self.heard.store(session.operator().stops(), Ordering::SeqCst);
            }
            let message = error.to_string();
            *lock(&self.failed) = Some(error);
            wrong(context, message)
        })
    }
}

/// An error at the place of the call.
pub(super) fn wrong(context: &NativeCallContext<'_>, message: String) -> Box<EvalAltResult> {
    Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(message), context.call_position()))
}

fn teach_wish(map: Map) -> Result<TeachWish, String> {
    let mut options = Options::new("teach", map);
    let mut wish = TeachWish::default();
    if let Some(study) = options.text("study")? {
        wish.study = study;
    }
    if let Some(side) = options.text("side")? {
        wish.side = match side.as_str() {
            "left" => Side::Left,
            "right" => Side::Right,
            other => return Err(format!("teach: `side` is \"left\" or \"right\"; found \"{other}\"")),
        };
    }
    if let Some(by) = options.text("by")? {
        wish.by = match by.as_str() {
            "compliance" => GuideBy::Compliance,
            "freedrive" => GuideBy::Freedrive,
            other => {
                return Err(format!(
                    "teach: `by` is \"compliance\" (probepath gives way) or \"freedrive\" (the arm does); found \"{other}\""
                ));
            }
        };
    }
    if let Some(within) = options.quantity::<Length>("stay_within")? {
        wish.stay_within_m = Some(within.si());
    }
    options.done()?;
    Ok(wish)
}

fn scan_wish(map: Map) -> Result<ScanWish, String> {
    let mut options = Options::new("scan", map);
    let mut wish = ScanWish::default();
    if let Some(speed) = options.quantity::<Speed>("speed")? {
        wish.speed_m_s = speed.si();
    }
    if let Some(force) = options.quantity::<Force>("force")? {
        wish.force_n = force.si();
    }
    if let Some(every) = options.quantity::<Length>("every")? {
        wish.every_m = Some(every.si());
    }
    if let Some(look) = options.flag("look")? {
        wish.look = look;
    }
    options.done()?;
    Ok(wish)
}

/// A seed point in the first B-scan: across from its left edge and below its first row (m).
fn seed(map: Map) -> Result<Option<(f64, f64)>, String> {
    let mut options = Options::new("reconstruct", map);
    let (x, y) = (options.quantity::<Length>("seed_x")?, options.quantity::<Length>("seed_y")?);
    options.done()?;
    match (x, y) {
        (Some(x), Some(y)) => Ok(Some((x.si(), y.si()))),
        (None, None) => Ok(None),
        _ => Err("reconstruct: a seed point needs both `seed_x` and `seed_y`".into()),
    }
}

fn report_wish(map: Map) -> Result<ReportWish, String> {
    let mut options = Options::new("report", map);
    let mut wish = ReportWish::default();
    for entry in options.list("segments")?.unwrap_or_else(Array::new) {
        let shown = entry.to_string();
        let segment = entry.try_cast::<Segment>().ok_or_else(|| {
            format!("report: `segments` is a list of segment(\"CFA\", mm(0), mm(40)); found {shown}")
        })?;
        wish.segments.push(segment);
    }
    options.done()?;
    Ok(wish)
}
