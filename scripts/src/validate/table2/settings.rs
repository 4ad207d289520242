//! What is reconstructed: the paper's ten settings, the same with its arm, what was otherwise, and the leg.

use probepath_sim::{ArmConfig, Case, CellConfig, ImagingConfig, MachineConfig, SubjectConfig, Window};

/// How the machine is set.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Setting {
    name: &'static str,
    depth_mm: f64,
    focus_mm: f64,
    window: Window,
    published: &'static str,
}

const fn whole(name: &'static str, depth_mm: f64, focus_mm: f64, published: &'static str) -> Setting {
    Setting { name, depth_mm, focus_mm, window: Window::Whole, published }
}

const fn zoomed(name: &'static str, top_mm: f64, height_mm: f64, published: &'static str) -> Setting {
    let window = Window::Zoom { top_mm, height_mm };
    Setting { name, depth_mm: 70.0, focus_mm: 45.0, window, published }
}

/// The settings, in the order of the paper; windows are centred on the vessel, 34 mm deep.
const SETTINGS: [Setting; 10] = [
    whole("depth 5 cm", 50.0, 45.0, "0.87 ± 0.08"),
    whole("depth 6 cm", 60.0, 45.0, "1.20 ± 0.02"),
    whole("depth 7 cm", 70.0, 45.0, "1.74 ± 0.08"),
    whole("depth 8 cm", 80.0, 45.0, "1.45 ± 0.12"),
    whole("focus 2-4 cm", 70.0, 30.0, "1.71 ± 0.03"),
    whole("focus 4-5 cm", 70.0, 45.0, "1.11 ± 0.003"),
    whole("focus 5-7 cm", 70.0, 60.0, "not done"),
    zoomed("zoom 2:7", 24.0, 20.0, "0.93 ± 0.04"),
    zoomed("zoom 3:7", 19.0, 30.0, "0.40 ± 0.03"),
    zoomed("zoom 4:7", 14.0, 40.0, "0.46 ± 0.03"),
];

/// The setting that is disturbed: the paper's best.
const DISTURBED: Setting = SETTINGS[8];
/// What is otherwise then: the five of the goal first.
const CASES: [Case; 10] = [
    Case::Curved,
    Case::Oblique,
    Case::WallAndContrast,
    Case::Speckle,
    Case::ArmDoubled,
    Case::Vein,
    Case::Shadow,
    Case::Reverberation,
    Case::Dim,
    Case::Bright,
];

/// How far a surface may be off on average (mm): with a UR e-series, and with the paper's arm.
const MOST_MEAN_MM: f64 = 0.25;
const MOST_MEAN_PAPER_ARM_MM: f64 = 0.40;
/// The hand goes this far, so that both stenoses lie whole inside what is scanned (mm).
const HAND_MM: f64 = 118.0;

/// One line of the table: a cell, and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// Its name.
    pub(super) name: String,
    /// What is scanned.
    pub(super) cell: CellConfig,
    /// The same machine and arm beside a phantom of wires, for the calibration.
    pub(super) bench: CellConfig,
    /// What the paper reached (mm).
    pub(super) published: Option<&'static str>,
    /// What is to be reached (mm).
    pub(super) most_mean_mm: f64,
}

impl Row {
    /// All of them, in the table's order.
    pub(super) fn all() -> Vec<Self> {
        let usual = SETTINGS.iter().map(|setting| Self::phantom(setting, None));
        let paper = SETTINGS.iter().map(|setting| Self::phantom(setting, Some(Case::PaperArm)));
        let disturbed = CASES.iter().map(|case| Self::phantom(&DISTURBED, Some(*case)));
        usual.chain(paper).chain(disturbed).chain([Self::leg()]).collect()
    }

    fn phantom(setting: &Setting, case: Option<Case>) -> Self {
        let mut cell = CellConfig::phantom();
        cell.hand.length_mm = HAND_MM;
        let machine = &mut cell.machine;
        (machine.depth_mm, machine.focus_mm) = (setting.depth_mm, setting.focus_mm);
        machine.window = setting.window;
        if let Some(case) = case {
            case.apply(&mut cell);
        }
        let name =
            case.map_or_else(|| setting.name.into(), |case| format!("{}, {}", setting.name, case.name()));
        let paper_arm = case == Some(Case::PaperArm);
        let most_mean_mm = if paper_arm { MOST_MEAN_PAPER_ARM_MM } else { MOST_MEAN_MM };
        let published = (case.is_none() || paper_arm).then_some(setting.published);
        Self::calibrated(name, cell, published, most_mean_mm)
    }

    /// The usual leg, with its bifurcation and three stenoses.
    fn leg() -> Self {
        Self::calibrated("leg".into(), CellConfig::default(), None, MOST_MEAN_MM)
    }

    /// With the bench on which this machine, set like this, is calibrated by this arm. Nobody knows the image's plane
    /// better than 3 mm and 3 degrees before.
    fn calibrated(
        name: String,
        cell: CellConfig,
        published: Option<&'static str>,
        most_mean_mm: f64,
    ) -> Self {
        let mut bench = CellConfig::wire_phantom();
        let unknown = (bench.machine.calibration_error_mm, bench.machine.calibration_error_deg);
        let mut cell = cell;
        (cell.machine.calibration_error_mm, cell.machine.calibration_error_deg) = unknown;
        bench.arm = ArmConfig { kinematic_error: cell.arm.kinematic_error, ..bench.arm };
        // The beam is the machine's, gain and dynamic range are set for water.
        let imaging = &cell.machine.imaging;
        let mut in_water = bench.machine.imaging.clone();
        in_water.axial_fwhm_m = imaging.axial_fwhm_m;
        in_water.lateral_factor = imaging.lateral_factor;
        in_water.elevational_factor = imaging.elevational_factor;
        bench.machine = MachineConfig { imaging: in_water, ..cell.machine.clone() };
        Self { name, cell, bench, published, most_mean_mm }
    }

    /// The same, the machine's stamps `late_ms` later than anybody was told.
    pub(super) fn late_by(mut self, late_ms: f64) -> Self {
        for cell in [&mut self.cell, &mut self.bench] {
            cell.knobs.machine.unknown_latency_ms = late_ms;
        }
        self
    }

    /// The same with a seed's own wall, 0.6 to 1.1 mm thick and of echogenicity 0.9 to 1.5, unless the line has a wall of
    /// its own: what holds for one wall by luck does not hold for ten.
    pub(super) fn walled_for(mut self, seed: u64) -> Self {
        // Evenly over both ranges however few the seeds are (the additive sequence of Roberts 2018).
        let part = |step: f64| (seed as f64 * step).fract();
        let usual = ImagingConfig::default();
        let imaging = &mut self.cell.machine.imaging;
        if (imaging.wall, imaging.wall_thickness_m) == (usual.wall, usual.wall_thickness_m) {
            imaging.wall_thickness_m = 0.6e-3 + 0.5e-3 * part(0.754_877_666);
            imaging.wall = 0.9 + 0.6 * part(0.569_840_291);
        }
        self
    }

    /// What the true stenoses are, percent of area.
    pub(super) fn true_percent(&self) -> Vec<f64> {
        let fractions: Vec<f64> = match &self.cell.subject {
            SubjectConfig::Leg(leg) => leg.stenoses.iter().map(|s| s.area_fraction).collect(),
            SubjectConfig::Phantom(phantom) => phantom.area_fractions.clone(),
            SubjectConfig::WirePhantom(_) => Vec::new(),
        };
        fractions.iter().map(|fraction| 100.0 * fraction).collect()
    }
}

#[cfg(test)]
mod tests {
    use probepath_sim::SimulatedCell;

    use super::*;

    #[test]
    fn every_seed_has_a_wall_of_its_own_unless_the_line_has() {
        let rows = Row::all();
        let wall = |row: &Row| (row.cell.machine.imaging.wall, row.cell.machine.imaging.wall_thickness_m);
        let walls: Vec<_> = (1..=10).map(|seed| wall(&rows[8].clone().walled_for(seed))).collect();
        assert!(
            walls.iter().all(|(echo, thick)| (0.9..=1.5).contains(echo) && (0.6e-3..=1.1e-3).contains(thick))
        );
        assert!(walls.iter().any(|wall| wall.1 < 0.68e-3) && walls.iter().any(|wall| wall.1 > 0.98e-3));
        let other = rows.iter().find(|row| row.name.ends_with("wall and contrast")).unwrap();
        assert_eq!(wall(other), wall(&other.clone().walled_for(3)));
    }

    #[test]
    fn bench_and_scan_are_of_one_machine_on_one_arm() {
        let rows = Row::all();
        assert_eq!(rows.len(), 31);
        for row in [&rows[0], &rows[8], &rows[11], &rows[23]] {
            let cells = [&row.bench, &row.cell].map(|config| SimulatedCell::new(config, 4).unwrap());
            let setting = cells[0].nominal().setting;
            assert_eq!(setting, cells[1].nominal().setting, "{}", row.name);
            let [one, other] = cells.each_ref().map(|cell| cell.truth().probe_from_image(&setting));
            assert!(one.origin().distance(&other.origin()) < 1e-12, "{}", row.name);
            let lags = cells.each_ref().map(|cell| cell.truth().lag());
            assert_eq!(lags[0], lags[1]);
        }
    }
}
