//! The centreline and the sections as tables (CSV): LPS, millimetres, a row for each place.

use std::fmt::Write;

use probepath_recon::{LumenReconstruction, Section};

/// Columns of the centreline's table.
const CENTRELINE: &str = "at_mm,x_mm,y_mm,z_mm,tangent_x,tangent_y,tangent_z";
/// Columns of the sections' table.
const SECTIONS: &str = "at_mm,x_mm,y_mm,z_mm,normal_x,normal_y,normal_z,area_mm2,area_sd_mm2,equivalent_diameter_mm,\
     least_diameter_mm,largest_diameter_mm";

/// The centreline at the sections' places.
pub(super) fn centreline(recon: &LumenReconstruction) -> String {
    let mut table = format!("{CENTRELINE}\n");
    for section in &recon.sections {
        place(&mut table, section);
        table.push('\n');
    }
    table
}

/// Every section; empty fields where no image shows the lumen.
pub(super) fn sections(recon: &LumenReconstruction) -> String {
    let mut table = format!("{SECTIONS}\n");
    for section in &recon.sections {
        place(&mut table, section);
        let Some(m) = &section.measure else {
            table.push_str(",,,,,\n");
            continue;
        };
        let _infallible = writeln!(
            table,
            ",{:.3},{:.3},{:.3},{:.3},{:.3}",
            m.area_mm2, m.area_sd_mm2, m.equivalent_diameter_mm, m.least_diameter_mm, m.largest_diameter_mm
        );
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
