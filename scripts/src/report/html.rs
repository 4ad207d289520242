//! The page: one HTML file, its pictures inside, readable on paper and on a small screen.

use std::fmt::Write as _;

use super::curve::{self, Mark};
use super::{Report, StenosisRow};

/// The pictures of a page, as addresses that hold them (`data:`).
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// The lumen surface with the stenoses marked.
    pub surface: Option<Surface>,
    /// B-scans with the contour drawn: what each shows, and the picture.
    pub bscans: Vec<(String, String)>,
}

/// The surface's picture, and what stands where on it.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// The picture, as an address that holds it.
    pub uri: String,
    /// Its width and height in pixels.
    pub size: (usize, usize),
    /// Names, with the column and row where each is written.
    pub labels: Vec<(String, (f64, f64))>,
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
    surface(&mut body, pictures.surface.as_ref());
    area(&mut body, report);
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
        "<header><h1>Artery of the {} leg</h1><p>Study <b>{}</b>{}</p></header>",
        escape(&of.side),
        escape(&of.study),
        of.date.as_deref().map(|d| format!(" · {}", escape(d))).unwrap_or_default()
    );
    let worst = report.stenoses.iter().max_by(|a, b| a.percent_area.total_cmp(&b.percent_area));
    let verdict = worst.map_or_else(
        || "No stenosis found in the scanned length.".to_owned(),
        |s| {
            format!(
                "{} found. The tightest, {}{}, leaves {:.1} mm² of {:.1} mm²: <b>{:.0} % of the area</b>, {:.0} % of the \
                 diameter, {:.0} mm from the proximal end.",
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
    let _ = write!(body, "<p class='verdict'>{verdict}</p>");
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

fn stenoses(body: &mut String, rows: &[StenosisRow]) {
    if rows.is_empty() {
        return;
    }
    body.push_str(
        "<h2>Stenoses</h2><table><thead><tr><th></th><th>Segment</th><th>Area lost</th><th>Diameter lost</th>\
         <th>Grade</th><th>At</th><th>Length</th><th>Smallest lumen</th><th>Off the middle</th><th>Reference</th></tr></thead><tbody>",
    );
    for s in rows {
        let _ = write!(
            body,
            "<tr><th>{}</th><td>{}</td><td class='n'>{:.1} %{}</td><td class='n'>{:.1} %{}</td><td class='n'>{}</td>\
             <td class='n'>{:.1} mm</td><td class='n'>{:.1} mm{}{}</td><td class='n'>{:.1} mm²{}{:.1} mm{}</td>\
             <td class='n'>{}</td><td>{:.1} mm², {}</td></tr>",
            escape(&s.name),
            escape(&s.segment),
            s.percent_area,
            interval(s.percent_area_interval),
            s.percent_diameter,
            interval(s.percent_diameter_interval),
            escape(&s.grade),
            s.at_mm,
            s.length_mm,
            interval(s.length_interval_mm),
            if s.cut_off { "runs on beyond the scan" } else { "" },
            s.min_area_mm2,
            interval(s.min_area_interval_mm2),
            s.min_diameter_mm,
            interval(s.min_diameter_interval_mm),
            s.asymmetry.map_or_else(|| "not known".to_owned(), |part| format!("{part:.2}")),
            s.reference_area_mm2,
            escape(&s.reference)
        );
    }
    body.push_str("</tbody></table>");
}

/// A 95 % interval, in small under its number.
fn interval([low, high]: [f64; 2]) -> String {
    format!("<small>{low:.1} to {high:.1}</small>")
}

fn surface(body: &mut String, surface: Option<&Surface>) {
    let Some(Surface { uri, size: (width, height), labels }) = surface else { return };
    let _ = write!(
        body,
        "<figure><svg viewBox='0 0 {width} {height}' role='img' aria-label='lumen surface'>\
         <image width='{width}' height='{height}' href='{uri}'/>"
    );
    for (name, (x, y)) in labels {
        let name = escape(name);
        let _ = write!(body, "<text class='label' x='{x:.0}' y='{y:.0}' text-anchor='middle'>{name}</text>");
    }
    body.push_str(
        "</svg><figcaption>Lumen surface, proximal end left, seen from the front; the darker, the narrower.\
         </figcaption></figure>",
    );
}

fn area(body: &mut String, report: &Report) {
    let points: Vec<_> =
        report.area_curve.iter().map(|p| (p.at_mm, p.area_mm2.unwrap_or(f64::NAN))).collect();
    let marks: Vec<_> = report
        .stenoses
        .iter()
        .map(|s| Mark { at_mm: s.at_mm, label: format!("{} {:.0} %", s.name, s.percent_area) })
        .collect();
    let _ = write!(body, "<h2>Lumen area</h2><figure>{}</figure>", curve::area_curve(&points, &marks));
}

fn segments(body: &mut String, report: &Report) {
    if report.segments.is_empty() {
        return;
    }
    body.push_str(
        "<h2>Segments</h2><table><thead><tr><th>Segment</th><th>From</th><th>To</th><th>Mean area</th>\
         <th>Mean diameter</th><th>Smallest area</th><th>Worst stenosis</th></tr></thead><tbody>",
    );
    for s in &report.segments {
        let worst = s.worst_percent_area.map_or_else(|| "none".to_owned(), |p| format!("{p:.1} % of area"));
        let _ = write!(
            body,
            "<tr><th>{}</th><td class='n'>{:.0} mm</td><td class='n'>{:.0} mm</td><td class='n'>{:.1} mm²</td>\
             <td class='n'>{:.2} mm</td><td class='n'>{:.1} mm²</td><td>{worst}</td></tr>",
            escape(&s.name),
            s.from_mm,
            s.until_mm,
            s.mean_area_mm2,
            s.mean_diameter_mm,
            s.min_area_mm2
        );
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
                "set {:.1} N, error {:.2} N RMS, overshoot {:.2} N at touch-down, largest {:.2} N",
                report.force_n.set, report.force_n.rms_error, report.force_n.overshoot, report.force_n.max
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
        "<footer>B-mode lumen geometry, not a Doppler grade. A research tool, not a medical device. Percent of area and \
         of diameter are against the reference named in the row. Two small numbers: the 95 % interval. Distances are along the centreline from the scan's \
         proximal end. Surfaces and volumes: millimetres, LPS.</footer>",
    );
}

const STYLE: &str = "\
:root{color-scheme:light;--ink:#1c2430;--soft:#5c6878;--line:#dfe4ea;--mark:#6a1b9a;--blood:#c0392b}\
body{margin:0;background:#f4f6f8;color:var(--ink);font:15px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif}\
main{max-width:920px;margin:0 auto;background:#fff;padding:32px 40px 40px}\
header{display:flex;justify-content:space-between;align-items:baseline;border-bottom:2px solid var(--ink)}\
h1{font-size:24px;margin:0 0 6px}h2{font-size:16px;margin:28px 0 8px}header p{margin:0;color:var(--soft)}\
.verdict{font-size:17px;margin:16px 0}\
.warnings{background:#fff6e0;border-left:4px solid #e0a100;margin:12px 0;padding:10px 10px 10px 28px}\
table{border-collapse:collapse;width:100%;font-size:14px}\
th,td{text-align:left;padding:5px 8px;border-bottom:1px solid var(--line);vertical-align:top}\
td.n{white-space:nowrap}td small{display:block;color:var(--soft)}svg text.label{font-size:26px;fill:var(--mark);font-weight:600}\
thead th{color:var(--soft);font-weight:600}td.n{font-variant-numeric:tabular-nums}\
.conditions th{width:190px;font-weight:600;color:var(--soft)}.conditions td{overflow-wrap:anywhere}\
figure{margin:8px 0}img,svg{max-width:100%;height:auto;display:block}figcaption{color:var(--soft);font-size:13px}\
.bscans{display:grid;grid-template-columns:repeat(auto-fit,minmax(250px,1fr));gap:14px}\
svg text{font-size:12px;fill:var(--soft)}svg .grid{stroke:var(--line)}svg .mark{stroke:var(--mark);stroke-dasharray:4 3}\
svg text.mark{stroke:none;fill:var(--mark);font-weight:600}svg .area{fill:none;stroke:var(--blood);stroke-width:2}\
footer{margin-top:28px;color:var(--soft);font-size:13px}\
@media print{body{background:#fff}main{padding:0}}";

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
    fn no_lesion_is_said_in_words() {
        assert!(page(&Report::default(), &Pictures::default()).contains("No stenosis found"));
    }
}
