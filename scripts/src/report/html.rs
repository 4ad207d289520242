//! The page: one HTML file, its pictures inside, readable on paper and on a small screen.

use std::fmt::Write as _;

use super::{Report, StenosisRow};

/// The pictures of a page, as addresses that hold them (`data:`).
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// The lumen surface with the stenoses marked.
    pub surface: Option<String>,
    /// The area curve, an inline SVG.
    pub area_curve: String,
    /// B-scans with the contour drawn: what each shows, and the picture.
    pub bscans: Vec<(String, String)>,
}

/// Text made safe inside a page.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c => safe.push(c),
        }
    }
    safe
}

/// The whole page.
pub fn page(report: &Report, pictures: &Pictures) -> String {
    let mut body = String::new();
    heading(&mut body, report);
    warnings(&mut body, report);
    stenoses(&mut body, &report.stenoses);
    surface(&mut body, pictures.surface.as_deref());
    area(&mut body, pictures);
    segments(&mut body, report);
    bscans(&mut body, pictures);
    conditions(&mut body, report);
    format!(
        "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' \
         content='width=device-width, initial-scale=1'><title>probepath report {}</title><style>{STYLE}</style></head>\
         <body><main>{body}</main></body></html>\n",
        escape(&report.exam_of.study)
    )
}

fn heading(body: &mut String, report: &Report) {
    let of = &report.exam_of;
    let _ = write!(
        body,
        "<header><h1>{}</h1><p>Study <b>{}</b> · {}</p></header>",
        if of.side.is_empty() {
            "Leg artery, side not given".into()
        } else {
            format!("Artery of the {} leg", escape(&of.side))
        },
        escape(&of.study),
        escape(of.date.as_deref().unwrap_or("date not given"))
    );
    let worst = report.stenoses.iter().max_by(|a, b| a.percent_area.total_cmp(&b.percent_area));
    let verdict = worst.map_or_else(
        || "No stenosis found in the scanned length.".to_owned(),
        |s| {
            format!(
                "{} found. The tightest, {}{}, leaves {:.1} mm² of {:.1} mm²: <b>{:.0} % of the area</b> and {:.0} % of the \
                 diameter are lost, {:.0} mm from the proximal end.",
                count(report.stenoses.len(), "stenosis", "stenoses"),
                s.name,
                if s.segment.is_empty() { String::new() } else { format!(" ({})", escape(&s.segment)) },
                s.min_area_mm2,
                s.reference_area_mm2,
                s.percent_area,
                s.percent_diameter,
                s.at_mm
            )
        },
    );
    let caution = worst.and_then(|s| Some(format!(" It may be narrower: {}.", s.may_be_narrower_because()?)));
    let _ = write!(body, "<p class='verdict'>{verdict}{}</p>", caution.unwrap_or_default());
}

/// A number and its noun.
pub(super) fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

fn warnings(body: &mut String, report: &Report) {
    if report.warnings.is_empty() {
        return;
    }
    body.push_str("<ul class='warnings'>");
    for warning in &report.warnings {
        let _ = write!(body, "<li>{}</li>", escape(warning));
    }
    body.push_str("</ul>");
}

/// What is said of each stenosis, after its name.
const LESION: [&str; 11] = [
    "Segment",
    "Area lost",
    "Diameter lost",
    "Grade by diameter",
    "Place",
    "Length",
    "Least area",
    "Least diameter",
    "Off the middle",
    "Force",
    "Reference",
];
/// What is said of each segment, after its name.
const SEGMENT: [&str; 7] =
    ["From", "To", "Mean area", "Mean diameter", "Smallest area", "Force", "Worst stenosis"];

/// A row of a table. Where the page is too narrow for one, each cell has its column's name beside it.
fn row(body: &mut String, name: &str, columns: &[&str], cells: &[String]) {
    let _ = write!(body, "<tr><th>{}</th>", escape(name));
    for (column, cell) in columns.iter().zip(cells) {
        let _ = write!(body, "<td data-is='{column}'><div>{cell}</div></td>");
    }
    body.push_str("</tr>");
}

fn stenoses(body: &mut String, rows: &[StenosisRow]) {
    if rows.is_empty() {
        return;
    }
    body.push_str("<h2>Stenoses</h2><table class='rows lesions'><thead><tr><th></th>");
    for name in LESION {
        let _ = write!(body, "<th>{name}</th>");
    }
    body.push_str("</tr></thead><tbody>");
    for s in rows {
        stenosis(body, s);
    }
    body.push_str(
        "</tbody></table><p class='note'>In brackets: 95 % intervals. Area and diameter lost are against the reference \
         in the same row; half the diameter is three quarters of the area. Place: the narrowest section, along the \
         centreline from the scan's proximal end. Off the middle: 0 in the vessel's middle, 1 against its wall.</p>",
    );
}

/// A 95 % interval, under its number.
fn span([low, high]: [f64; 2]) -> String {
    format!("<span class='span'>[{low:.1}, {high:.1}]</span>")
}

fn stenosis(body: &mut String, s: &StenosisRow) {
    let force = s.force_n.map_or_else(|| "not measured".into(), |force| format!("{force:.1} N"));
    let asymmetry = s.asymmetry.map_or_else(|| "not known".to_owned(), |part| format!("{part:.2}"));
    let cells = [
        or_not_named(&escape(&s.segment)).to_owned(),
        format!("<b>{:.1} %</b>{}{}", s.percent_area, span(s.percent_area_interval), caution(s)),
        format!("<b>{:.1} %</b>{}", s.percent_diameter, span(s.percent_diameter_interval)),
        escape(&s.grade),
        format!("{:.1} mm{}", s.at_mm, span(s.at_interval_mm)),
        format!(
            "{:.1} mm{}{}",
            s.length_mm,
            span(s.length_interval_mm),
            if s.cut_off { "<span class='span'>runs on beyond the scan</span>" } else { "" }
        ),
        format!("{:.1} mm²{}", s.min_area_mm2, span(s.min_area_interval_mm2)),
        format!("{:.1} mm{}", s.min_diameter_mm, span(s.min_diameter_interval_mm)),
        asymmetry,
        force,
        format!("{:.1} mm²<span class='words'>{}</span>", s.reference_area_mm2, escape(&s.reference)),
    ];
    row(body, &s.name, &LESION, &cells);
}

/// That its narrowest place may not have been seen.
fn caution(s: &StenosisRow) -> String {
    s.may_be_narrower_because()
        .map_or_else(String::new, |why| format!("<span class='span'>may be narrower: {why}</span>"))
}

fn or_not_named(text: &str) -> &str {
    if text.is_empty() { "not named" } else { text }
}

fn surface(body: &mut String, uri: Option<&str>) {
    let Some(uri) = uri else { return };
    let _ = write!(
        body,
        "<h2>Lumen</h2><figure class='wide'><div><img alt='the lumen surface from two sides' src='{uri}'></div><figcaption>The lumen's surface, \
         proximal end left. L, R, A, P, F: toward the patient's left, right, front, back, feet.</figcaption></figure>"
    );
}

fn area(body: &mut String, pictures: &Pictures) {
    let _ = write!(
        body,
        "<h2>Lumen area</h2><figure class='wide'><div>{}</div><figcaption>Area of the sections normal to the centreline; the band is the 95 % \
         interval, shaded columns the extent of each stenosis. Where the line is broken, nothing was measured.</figcaption>\
         </figure>",
        pictures.area_curve
    );
}

fn segments(body: &mut String, report: &Report) {
    if report.segments.is_empty() {
        return;
    }
    body.push_str("<h2>Segments</h2><table class='rows'><thead><tr><th></th>");
    for name in SEGMENT {
        let _ = write!(body, "<th>{name}</th>");
    }
    body.push_str("</tr></thead><tbody>");
    for s in &report.segments {
        let cells = [
            format!("{:.0} mm", s.from_mm),
            format!("{:.0} mm", s.until_mm),
            format!("{:.1} mm²{}", s.mean_area_mm2, span(s.mean_area_interval_mm2)),
            format!("{:.2} mm", s.mean_diameter_mm),
            format!("{:.1} mm²{}", s.min_area_mm2, span(s.min_area_interval_mm2)),
            s.mean_force_n.map_or_else(|| "not measured".to_owned(), |n| format!("{n:.1} N")),
            s.worst_percent_area.map_or_else(|| "none".to_owned(), |p| format!("{p:.1} % of area")),
        ];
        row(body, &s.name, &SEGMENT, &cells);
    }
    body.push_str("</tbody></table>");
}

fn bscans(body: &mut String, pictures: &Pictures) {
    if pictures.bscans.is_empty() {
        return;
    }
    body.push_str("<h2>B-scans</h2><div class='bscans'>");
    for (caption, uri) in &pictures.bscans {
        let caption = escape(caption);
        let _ = write!(
            body,
            "<figure><img alt='{caption}' src='{uri}'><figcaption>{caption}</figcaption></figure>"
        );
    }
    body.push_str("</div>");
}

fn conditions(body: &mut String, report: &Report) {
    let of = &report.exam_of;
    let mut rows: Vec<(&str, String)> = vec![
        (
            "Setting",
            format!(
                "depth {:.0} mm, focus {:.0} mm, picture {:.0} mm high",
                of.depth_mm, of.focus_mm, of.window_mm
            ),
        ),
        (
            "Calibration",
            of.calibration_rms_mm
                .map_or_else(|| of.calibration.clone(), |e| format!("{}, {e:.2} mm RMS", of.calibration)),
        ),
        (
            "Contact",
            format!(
                "{}set {:.1} N, error {:.2} N RMS, overshoot {:.2} N at touch-down, largest {:.2} N",
                report.mean_force_n.map(|mean| format!("mean {mean:.1} N, ")).unwrap_or_default(),
                report.force_n.set,
                report.force_n.rms_error,
                report.force_n.overshoot,
                report.force_n.max
            ),
        ),
        (
            "Path",
            format!(
                "{:.0} mm at {:.0} mm/s, {:.2} mm RMS beside the taught path; smoothing moved it by at most {:.2} mm",
                report.path.length_mm, of.speed_mm_s, report.path.rms_error_mm, report.path.smoothing_max_mm
            ),
        ),
        (
            "B-scans",
            format!(
                "{} kept, {} lost, {} without a lumen",
                report.images.kept, report.images.dropped, report.images.without_lumen
            ),
        ),
        ("Duration", format!("{:.0} s", report.duration_s)),
        ("Cell", of.cell.clone()),
        ("Protocol", format!("{} ({})", of.protocol, of.protocol_sha256.get(..12).unwrap_or(""))),
        ("Exam", report.exam.clone()),
        ("Software", of.software.clone()),
    ];
    if let Some(error) = report.surface_error_mm {
        let text = format!("{:.2} mm mean, {:.2} mm at the 95th percentile", error.mean, error.p95);
        rows.insert(0, ("Error against the simulated truth", text));
    }
    body.push_str("<h2>Conditions</h2><table class='conditions'><tbody>");
    for (name, value) in rows {
        let _ = write!(body, "<tr><th>{name}</th><td>{}</td></tr>", escape(&value));
    }
    body.push_str("</tbody></table>");
    body.push_str(
        "<footer><b>B-mode lumen geometry, not a Doppler grade. A research tool, not a medical device.</b> Flow was not \
         measured. The probe's pressure flattens an artery: the force is in the table. Intervals hold what the images, \
         poses and calibration leave open, not what another observer would have scanned. Surfaces and volumes: \
         millimetres, LPS.</footer>",
    );
}

const STYLE: &str = "\
:root{color-scheme:light;--ink:#1c2430;--soft:#5c6878;--line:#dfe4ea;--mark:#005aa0}\
body{margin:0;background:#eef1f4;color:var(--ink);font:15px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif}\
main{max-width:980px;margin:24px auto;background:#fff;padding:36px 48px 44px;box-shadow:0 1px 3px rgba(20,30,50,.12)}\
header{display:flex;flex-wrap:wrap;gap:0 24px;justify-content:space-between;align-items:baseline;border-bottom:2px solid var(--ink)}\
h1{font-size:25px;font-weight:600;margin:0 0 6px}h2{font-size:16px;font-weight:600;margin:30px 0 8px}\
header p{margin:0 0 6px;color:var(--soft)}\
.verdict{font-size:18px;line-height:1.45;margin:18px 0}\
.warnings{background:#fff6e0;border-left:4px solid #e0a100;margin:12px 0;padding:10px 10px 10px 28px}\
table{border-collapse:collapse;width:100%;font-size:14px}\
th,td{text-align:left;padding:6px 8px;border-bottom:1px solid var(--line);vertical-align:top}\
thead th{color:var(--soft);font-weight:600;font-size:13px;line-height:1.3;border-bottom:1px solid var(--soft)}\
.rows td{font-variant-numeric:tabular-nums}.lesions tbody th{color:var(--mark)}\
.span,.words{display:block;color:var(--soft);font-size:12.5px}.span{white-space:nowrap}.words{min-width:92px;line-height:1.3}\
.note{color:var(--soft);font-size:13px;margin:6px 0 0}\
.conditions th{width:190px;font-weight:600;color:var(--soft)}.conditions td{overflow-wrap:anywhere}\
figure{margin:8px 0}img,svg{max-width:100%;width:100%;height:auto;display:block}figcaption{color:var(--soft);font-size:13px;margin-top:6px}\
.bscans{display:grid;grid-template-columns:repeat(auto-fit,minmax(260px,1fr));gap:16px}.bscans img{border-radius:2px}\
footer{margin-top:30px;padding-top:12px;border-top:1px solid var(--line);color:var(--soft);font-size:13px}\
@media(max-width:700px){main{margin:0;padding:20px}.wide>div{overflow-x:auto}.wide img,.wide svg{width:760px;max-width:none}\
.rows,.rows tbody,.rows tr,.rows th,.conditions,.conditions tbody,.conditions tr,.conditions th,.conditions td{display:block;width:auto}\
.rows thead{display:none}.rows tbody th{font-size:16px;padding-top:14px;border-bottom:1px solid var(--soft)}\
.rows td{display:grid;grid-template-columns:8.5em 1fr;gap:8px}.rows td::before{content:attr(data-is);color:var(--soft)}\
.conditions th{border:0;padding-bottom:0}.conditions td{padding-top:0}}\
@media print{body{background:#fff}main{margin:0;padding:0;box-shadow:none;max-width:none}h2,figure,tr{break-inside:avoid}}";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_code_cannot_break_the_page() {
        let mut report = Report::default();
        report.exam_of.study = "<script>alert('x')</script>".into();
        let page = page(&report, &Pictures::default());
        assert!(!page.contains("<script>"), "{page}");
        assert!(page.contains("&lt;script&gt;"));
    }

    #[test]
    fn the_page_names_no_address_outside_itself() {
        let page = page(&Report::default(), &Pictures::default());
        assert!(!page.contains("http"), "{page}");
    }

    #[test]
    fn a_lesion_that_was_not_seen_whole_is_said_to_be_possibly_narrower() {
        let said = |may_be_narrower: bool, unseen_mm: f64| {
            let stenosis =
                StenosisRow { name: "S1".into(), may_be_narrower, unseen_mm, ..StenosisRow::default() };
            let report =
                Report { report: "report.html".into(), stenoses: vec![stenosis], ..Report::default() };
            (page(&report, &Pictures::default()), report.to_string())
        };
        let (page, text) = said(true, 2.5);
        // In the verdict and in the table.
        assert_eq!(page.matches("may be narrower: 2.5 mm of it no image shows").count(), 2, "{page}");
        assert!(text.contains("S1   may be narrower: 2.5 mm of it no image shows"), "{text}");
        let (page, text) = said(true, 0.0);
        assert!(page.contains("narrowest where the scan ends") && text.contains("where the scan ends"));
        let (page, text) = said(false, 0.0);
        assert!(!page.contains("may be narrower") && !text.contains("may be narrower"));
    }

    #[test]
    fn no_lesion_is_said_in_words() {
        assert!(page(&Report::default(), &Pictures::default()).contains("No stenosis found"));
    }
}
