//! [`Case`]: what makes a scan harder than the usual one, each as a change of a cell's configuration. All off by default.

use crate::arm::KinematicError;
use crate::cell::{CellConfig, SubjectConfig};
use crate::ultrasound::{Reverberation, Shadow};

/// One thing that is otherwise than in the usual cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Case {
    /// The phantom's vessel bends: 10 mm sideways and 3 mm down in its middle (radius of curvature about 240 mm).
    Curved,
    /// The probe is held 20 degrees off square to the vessel, and leans 5 degrees along it.
    Oblique,
    /// A thinner, fainter wall (0.5 mm, echogenicity 0.8) and a lumen that echoes more (0.035).
    WallAndContrast,
    /// Coarser speckle: scatterers 0.5 mm apart, a pulse of 0.5 mm and a beam 1.4 times as wide.
    Speckle,
    /// An arm with twice the errors of a UR e-series: accuracy 0.20 mm, repeatability 0.06 mm.
    ArmDoubled,
    /// The arm of [P1]: accuracy 0.50 to 0.70 mm, repeatability 0.20 mm (FIELD.md section 8).
    PaperArm,
    /// A vein of 8 mm lies against the artery's wall.
    Vein,
    /// Beside the lumen's middle 3 mm of the array see nothing: 20 dB less.
    Shadow,
    /// Bands of the skin's ringing every 4.5 mm, through the lumen too.
    Reverberation,
    /// 15 dB less gain.
    Dim,
    /// 10 dB more gain.
    Bright,
}

impl Case {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Curved,
        Self::Oblique,
        Self::WallAndContrast,
        Self::Speckle,
        Self::ArmDoubled,
        Self::PaperArm,
        Self::Vein,
        Self::Shadow,
        Self::Reverberation,
        Self::Dim,
        Self::Bright,
    ];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Curved => "curved vessel",
            Self::Oblique => "oblique sweep",
            Self::WallAndContrast => "wall and contrast",
            Self::Speckle => "speckle size",
            Self::ArmDoubled => "arm error doubled",
            Self::PaperArm => "the paper's arm",
            Self::Vein => "vein at the wall",
            Self::Shadow => "shadow",
            Self::Reverberation => "reverberation",
            Self::Dim => "dim",
            Self::Bright => "bright",
        }
    }

    /// Changes a cell so.
    pub fn apply(self, cell: &mut CellConfig) {
        let imaging = &mut cell.machine.imaging;
        match self {
            Self::Curved => bow(&mut cell.subject),
            Self::Oblique => (cell.hand.turn_deg, cell.hand.lean_deg) = (20.0, 5.0),
            Self::WallAndContrast => {
                (imaging.wall, imaging.wall_thickness_m, imaging.lumen) = (0.8, 0.5e-3, 0.035);
            }
            Self::Speckle => {
                (imaging.lattice_m, imaging.axial_fwhm_m, imaging.lateral_factor) = (0.5e-3, 0.5e-3, 1.4);
            }
            Self::ArmDoubled => {
                cell.arm.kinematic_error =
                    KinematicError::Figures { accuracy_mm: 0.20, repeatability_mm: 0.06 };
            }
            Self::PaperArm => cell.arm.kinematic_error = KinematicError::Paper,
            Self::Vein => vein(&mut cell.subject),
            Self::Shadow => {
                imaging.shadows.push(Shadow { across_m: [0.0215, 0.0245], below_m: 0.010, loss_db: 20.0 });
            }
            Self::Reverberation => {
                imaging.reverberation = Some(Reverberation { every_m: 4.5e-3, first_db: 0.0, loss_db: 4.0 });
            }
            Self::Dim => imaging.gain_db = -15.0,
            Self::Bright => imaging.gain_db = 10.0,
        }
    }
}

fn bow(subject: &mut SubjectConfig) {
    if let SubjectConfig::Phantom(phantom) = subject {
        phantom.bow_m = [0.010, 0.003];
    }
}

fn vein(subject: &mut SubjectConfig) {
    match subject {
        SubjectConfig::Phantom(phantom) => phantom.vein_gap_m = Some(0.8e-3),
        SubjectConfig::Leg(leg) => (leg.vein, leg.vein_gap_m) = (true, Some(0.8e-3)),
        SubjectConfig::WirePhantom(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::SimulatedCell;

    #[test]
    fn every_case_changes_the_cell_and_can_be_built() {
        for case in Case::ALL {
            let mut cell = CellConfig::phantom();
            case.apply(&mut cell);
            assert_ne!(cell, CellConfig::phantom(), "{}", case.name());
            SimulatedCell::new(&cell, 1).unwrap();
        }
    }
}
