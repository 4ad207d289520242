//! The centreline as a table (CSV): LPS, millimetres, a row for each place.

use std::fmt::Write;

use probepath_recon::{LumenReconstruction, Section};

/// Columns of the centreline's table.
const CENTRELINE: &str = "at_mm,x_mm,y_mm,z_mm,tangent_x,tangent_y,tangent_z";
/// The centreline at the sections' places.
pub(super) fn centreline(recon: &LumenReconstruction) -> String {
    let mut table = format!("{CENTRELINE}\n");
    for section in &recon.sections {
        place(&mut table, section);
        table.push('\n');
    }
    table
}

fn place(table: &mut String, section: &Section) {
    let (at, way) = (section.centre.vector() * 1e3, section.normal.vector());
    let _infallible = write!(
        table,
        "{:.3},{:.4},{:.4},{:.4},{:.6},{:.6},{:.6}",
        section.at_mm, at.x, at.y, at.z, way.x, way.y, way.z
    );
}
