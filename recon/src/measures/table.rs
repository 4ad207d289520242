//! The sections as a table: one row for each, as CSV (units in the columns' names, an empty field where nothing was
//! measured) or as JSON ([`SectionRow`] is serialisable). World coordinates, LPS.
//!
//! ```
//! use probepath_recon::measures::table;
//!
//! # fn main() -> Result<(), table::TableError> {
//! let text = table::to_csv(&[]);
//! assert!(text.starts_with("at_mm,x_mm,y_mm,z_mm,"));
//! assert!(table::from_csv(&text)?.is_empty());
//! # Ok(())
//! # }
//! ```

use std::fmt::Write as _;

use nalgebra::Vector3;
use probepath_frames::{Direction, Point};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::section::{NotMeasured, area_interval, diameter_of};
use crate::{Section, SectionMeasure};

/// A row of the table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SectionRow {
    /// Length along the centreline from the first image (mm).
    pub at_mm: f64,
    /// The centreline's point (mm, World).
    pub centre_mm: [f64; 3],
    /// The centreline's direction.
    pub normal: [f64; 3],
    /// The outline's centre of gravity (mm, World).
    pub middle_mm: [f64; 3],
    /// Whether it was measured.
    pub measured: bool,
    /// Why not.
    pub missing: Option<NotMeasured>,
    /// The measures.
    pub measure: Option<SectionMeasure>,
    /// 95 % interval of the equivalent diameter (mm).
    pub diameter_interval_mm: Option<[f64; 2]>,
    /// Mean contact force of the images near it (N).
    pub force_n: Option<f64>,
}

/// The CSV's columns: what a row holds, in the order of its fields. Intervals are of 95 %. `area_random_sd_mm2` is what
/// neighbouring sections share only in part, `area_common_sd_mm2` what the whole scan shares.
pub const COLUMNS: [&str; 25] = [
    "at_mm",
    "x_mm",
    "y_mm",
    "z_mm",
    "normal_x",
    "normal_y",
    "normal_z",
    "middle_x_mm",
    "middle_y_mm",
    "middle_z_mm",
    "measured",
    "missing",
    "area_mm2",
    "area_low_mm2",
    "area_high_mm2",
    "area_random_sd_mm2",
    "area_common_sd_mm2",
    "equivalent_diameter_mm",
    "diameter_low_mm",
    "diameter_high_mm",
    "inscribed_diameter_mm",
    "least_diameter_mm",
    "largest_diameter_mm",
    "circularity",
    "force_n",
];

/// A text that is no table of sections.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TableError {
    /// A column is missing.
    #[error("the table's first line has no column {column:?}: is it a table of sections (sections.csv)?")]
    Column {
        /// Its name.
        column: &'static str,
    },
    /// A field that is no number.
    #[error("line {line}, column {column}: {found:?} is not {wanted}")]
    Field {
        /// The line, from 1.
        line: usize,
        /// The column.
        column: &'static str,
        /// What is there.
        found: String,
        /// What should be.
        wanted: &'static str,
    },
    /// Rows that do not go along the vessel.
    #[error("line {line}: at_mm = {at_mm} does not come after the row before it")]
    Order {
        /// The line, from 1.
        line: usize,
        /// Its place.
        at_mm: f64,
    },
}

impl From<&Section> for SectionRow {
    fn from(section: &Section) -> Self {
        let mm = |v: Vector3<f64>| (v * 1e3).into();
        Self {
            at_mm: section.at_mm,
            centre_mm: mm(section.centre.vector()),
            normal: section.normal.vector().into(),
            middle_mm: mm(section.middle.vector()),
            measured: section.measure.is_some(),
            missing: section.missing,
            measure: section.measure,
            diameter_interval_mm: section.measure.as_ref().map(SectionMeasure::diameter_interval_mm),
            force_n: section.force_n,
        }
    }
}

/// The sections as rows, for JSON.
pub fn rows(sections: &[Section]) -> Vec<SectionRow> {
    sections.iter().map(SectionRow::from).collect()
}

/// The sections as CSV, a line of names first ([`COLUMNS`]).
pub fn to_csv(sections: &[Section]) -> String {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for row in rows(sections) {
        let fields: Vec<String> = fields(&row).into_iter().map(Option::unwrap_or_default).collect();
        let _ = writeln!(text, "{}", fields.join(","));
    }
    text
}

/// A row's fields, in the columns' order.
fn fields(row: &SectionRow) -> Vec<Option<String>> {
    let place = |x: &f64| Some(format!("{x:.4}"));
    let part = |x: &f64| Some(format!("{x:.6}"));
    let mut fields = vec![place(&row.at_mm)];
    fields.extend(row.centre_mm.iter().map(place));
    fields.extend(row.normal.iter().map(part));
    fields.extend(row.middle_mm.iter().map(place));
    fields.push(Some(row.measured.to_string()));
    fields.push(row.missing.map(|why| why.name().to_owned()));
    let measured = row.measure.as_ref().map(numbers);
    fields.extend(match measured {
        Some(numbers) => numbers.iter().map(part).collect(),
        None => vec![None; 12],
    });
    fields.push(row.force_n.map(|force| format!("{force:.3}")));
    fields
}

/// The measures, in the columns' order.
fn numbers(measure: &SectionMeasure) -> [f64; 12] {
    let [low, high] = measure.area_interval_mm2;
    [
        measure.area_mm2,
        low,
        high,
        measure.area_sd_mm2,
        measure.area_common_sd_mm2,
        measure.equivalent_diameter_mm,
        diameter_of(low),
        diameter_of(high),
        measure.inscribed_diameter_mm,
        measure.least_diameter_mm,
        measure.largest_diameter_mm,
        measure.circularity,
    ]
}

impl NotMeasured {
    /// As the tables have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotSeen => "not_seen",
            Self::Crossing => "crossing",
        }
    }

    fn named(name: &str) -> Option<Self> {
        [Self::NotSeen, Self::Crossing].into_iter().find(|why| why.name() == name)
    }
}

/// The sections of a CSV that [`to_csv`] wrote. Further columns are passed over; the intervals are made again from the
/// standard deviations.
///
/// # Errors
/// When a column is missing, a field is no number, or the rows do not go along the vessel.
pub fn from_csv(text: &str) -> Result<Vec<Section>, TableError> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let header: Vec<&str> =
        lines.next().map(|(_, line)| line.split(',').map(str::trim).collect()).unwrap_or_default();
    let needed = |column: &&&'static str| !header.contains(*column);
    if let Some(column) = COLUMNS.iter().find(needed) {
        return Err(TableError::Column { column });
    }
    let mut sections: Vec<Section> = Vec::new();
    for (number, line) in lines {
        let line =
            Line { number: number + 1, header: &header, fields: line.split(',').map(str::trim).collect() };
        let section = line.section()?;
        if sections.last().is_some_and(|last| last.at_mm >= section.at_mm) {
            return Err(TableError::Order { line: line.number, at_mm: section.at_mm });
        }
        sections.push(section);
    }
    Ok(sections)
}

/// A line of the table, with the columns' names.
struct Line<'a> {
    number: usize,
    header: &'a [&'a str],
    fields: Vec<&'a str>,
}

impl Line<'_> {
    fn text(&self, column: &str) -> &str {
        let at = self.header.iter().position(|name| *name == column);
        at.and_then(|at| self.fields.get(at)).copied().unwrap_or_default()
    }

    fn wrong(&self, column: &'static str, wanted: &'static str) -> TableError {
        TableError::Field { line: self.number, column, found: self.text(column).into(), wanted }
    }

    fn number(&self, column: &'static str) -> Result<f64, TableError> {
        let number = self.text(column).parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.wrong(column, "a finite number"))
    }

    fn positive(&self, column: &'static str) -> Result<f64, TableError> {
        let number = self.number(column)?;
        if number >= 0.0 { Ok(number) } else { Err(self.wrong(column, "zero or more")) }
    }

    fn vector(&self, [x, y, z]: [&'static str; 3]) -> Result<Vector3<f64>, TableError> {
        Ok(Vector3::new(self.number(x)?, self.number(y)?, self.number(z)?))
    }

    fn section(&self) -> Result<Section, TableError> {
        let centre = self.vector(["x_mm", "y_mm", "z_mm"])?;
        let middle = self.vector(["middle_x_mm", "middle_y_mm", "middle_z_mm"])?;
        let normal = self.vector(["normal_x", "normal_y", "normal_z"])?;
        let measure = match self.text("measured") {
            "true" => Some(self.measure()?),
            "false" => None,
            _ => return Err(self.wrong("measured", "true or false")),
        };
        let missing = match (&measure, self.text("missing")) {
            (Some(_), _) => None,
            (None, why) => Some(
                NotMeasured::named(why)
                    .ok_or_else(|| self.wrong("missing", "a reason: not_seen or crossing"))?,
            ),
        };
        let force = (!self.text("force_n").is_empty()).then(|| self.number("force_n")).transpose()?;
        Ok(Section {
            at_mm: self.number("at_mm")?,
            centre: Point::from_vector(centre / 1e3),
            normal: Direction::of(normal).map_err(|_| self.wrong("normal_x", "part of a direction"))?,
            middle: Point::from_vector(middle / 1e3),
            force_n: force,
            measure,
            missing,
        })
    }

    fn measure(&self) -> Result<SectionMeasure, TableError> {
        let area_mm2 = self.positive("area_mm2")?;
        let random = self.positive("area_random_sd_mm2")?;
        let common = self.positive("area_common_sd_mm2")?;
        Ok(SectionMeasure {
            area_mm2,
            area_sd_mm2: random,
            area_common_sd_mm2: common,
            area_interval_mm2: area_interval(area_mm2, random.hypot(common)),
            equivalent_diameter_mm: diameter_of(area_mm2),
            inscribed_diameter_mm: self.positive("inscribed_diameter_mm")?,
            least_diameter_mm: self.positive("least_diameter_mm")?,
            largest_diameter_mm: self.positive("largest_diameter_mm")?,
            circularity: self.positive("circularity")?,
        })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A round section on World z.
    pub(crate) fn section(at_mm: f64, area_mm2: f64) -> Section {
        let diameter = diameter_of(area_mm2);
        let measure = SectionMeasure {
            area_mm2,
            area_sd_mm2: 0.0,
            area_common_sd_mm2: 0.0,
            area_interval_mm2: [area_mm2; 2],
            equivalent_diameter_mm: diameter,
            inscribed_diameter_mm: diameter,
            least_diameter_mm: diameter,
            largest_diameter_mm: diameter,
            circularity: 1.0,
        };
        let centre = Point::new(0.0, 0.0, at_mm * 1e-3);
        Section {
            at_mm,
            centre,
            normal: Direction::z(),
            middle: centre,
            force_n: Some(5.0),
            measure: Some(measure.with_sd(0.5, 0.3)),
            missing: None,
        }
    }

    fn table() -> Vec<Section> {
        let mut sections: Vec<Section> =
            (0..9).map(|i| section(0.5 * f64::from(i), 40.0 - f64::from(i))).collect();
        sections[3].measure = None;
        sections[3].missing = Some(NotMeasured::Crossing);
        sections[4].force_n = None;
        sections
    }

    #[test]
    fn a_table_written_and_read_is_the_same_to_its_digits() {
        let sections = table();
        let read = from_csv(&to_csv(&sections)).expect("a table");
        assert_eq!(read.len(), sections.len());
        for (ours, theirs) in sections.iter().zip(&read) {
            assert_eq!((ours.missing, ours.force_n), (theirs.missing, theirs.force_n));
            let (Some(a), Some(b)) = (&ours.measure, &theirs.measure) else {
                assert!(ours.measure.is_none() && theirs.measure.is_none());
                continue;
            };
            assert!((a.area_mm2 - b.area_mm2).abs() < 1e-6);
            assert!((a.area_interval_mm2[1] - b.area_interval_mm2[1]).abs() < 1e-4);
            assert!(ours.centre.distance(&theirs.centre) < 1e-7);
        }
        assert_eq!(to_csv(&read), to_csv(&sections));
        let json = serde_json::to_string(&rows(&sections)).expect("JSON");
        let back: Vec<SectionRow> = serde_json::from_str(&json).expect("rows");
        assert_eq!(back, rows(&sections));
    }

    #[test]
    fn every_line_has_every_column() {
        for line in to_csv(&table()).lines() {
            assert_eq!(line.split(',').count(), COLUMNS.len(), "{line}");
        }
    }

    #[test]
    fn what_is_no_table_of_sections_is_refused_with_its_line() {
        assert_eq!(from_csv("a,b\n1,2\n"), Err(TableError::Column { column: "at_mm" }));
        assert_eq!(from_csv(""), Err(TableError::Column { column: "at_mm" }));
        let good = to_csv(&table());
        let with = |from: &str, to: &str| from_csv(&good.replacen(from, to, 1));
        assert!(matches!(
            with("40.000000", "forty"),
            Err(TableError::Field { line: 2, column: "area_mm2", .. })
        ));
        assert!(matches!(with("40.000000", "-1.0"), Err(TableError::Field { line: 2, .. })));
        assert!(matches!(with("40.000000", "NaN"), Err(TableError::Field { .. })));
        assert!(matches!(with("true", "yes"), Err(TableError::Field { column: "measured", .. })));
        assert!(matches!(with("0.5000,", "0.0000,"), Err(TableError::Order { line: 3, .. })));
        let cut = &good[..good.len() - 60];
        assert!(from_csv(cut).is_err(), "a table cut short in its last line");
    }
}
