//! Poses that might be visited: the phantom's middle and places around it in the middle of the window, tilted and
//! turned every way.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Point, Pose, Probe, World};

use super::information::{Information, View};
use super::{Bench, NoPlan, Refused, VisitOptions};

/// Steps from end to end of the phantom, and of the window.
const ALONG: [f64; 3] = [-0.2, 0.0, 0.2];
const ACROSS: [f64; 5] = [-0.5, -0.25, 0.0, 0.25, 0.5];
const BESIDE: [f64; 3] = [-1.0, 0.0, 1.0];
/// More candidates than this are thinned out evenly: choosing takes time.
const MOST: usize = 700;

/// The phantom's own axes in the World, as the probe should see it.
#[derive(Clone, Copy)]
pub(super) struct Stand {
    /// The middle of the wires (m).
    middle: Vector3<f64>,
    /// Along a row, along a column (the beam), and the image's normal: along the wires.
    axes: Matrix3<f64>,
    /// From end to end of the wires along these axes (m).
    extent: Vector3<f64>,
    /// The height of the highest wire over the middle, against the beam (m).
    top: f64,
}

/// One pose that shows enough wires and is clear of them.
struct Candidate {
    pose: Pose<World, Probe>,
    information: Information,
    upright: bool,
    taken: bool,
    reachable: Option<bool>,
}

/// Every pose that might be visited.
pub(super) struct Candidates<'a> {
    bench: &'a Bench<'a>,
    options: &'a VisitOptions,
    wires: usize,
    stand: Stand,
    all: Vec<Candidate>,
    pub(super) refused: Refused,
}

impl<'a> Candidates<'a> {
    /// Those that show at least so many wires.
    pub(super) fn new(bench: &'a Bench<'a>, options: &'a VisitOptions, wires: usize) -> Result<Self, NoPlan> {
        let stand = Stand::of(bench)?;
        let mut candidates =
            Self { bench, options, wires, stand, all: Vec::new(), refused: Refused::default() };
        let mut poses: Vec<_> = candidates.grid();
        candidates.refused.considered = poses.len();
        poses.retain(|(pose, _)| candidates.is_usable(pose));
        let view = View::new(bench, options);
        // The remainder runs through the grid evenly: 701 of 1400 would be every second otherwise.
        let kept = poses.len().min(MOST);
        candidates.all = (0..kept)
            .filter_map(|i| poses.get(i * poses.len() / kept))
            .map(|(pose, upright)| Candidate {
                pose: *pose,
                information: view.at_rest(pose),
                upright: *upright,
                taken: false,
                reachable: None,
            })
            .collect();
        Ok(candidates)
    }

    /// Poses tilted and turned every way over every place, and whether each is neither tilted nor turned.
    fn grid(&self) -> Vec<(Pose<World, Probe>, bool)> {
        let extent = self.stand.extent;
        let (tilt, twist) = (self.options.tilt_rad, self.options.turn_rad);
        let high = extent.y + self.bench.setting.window_height_m / 2.0;
        let scaled = |by: Vector3<f64>| move |v: Vector3<f64>| v.component_mul(&by);
        let places = every(&ACROSS, &ACROSS, &ALONG).map(scaled(Vector3::new(extent.x, high, extent.z)));
        let turns: Vec<_> =
            every(&BESIDE, &BESIDE, &BESIDE).map(scaled(Vector3::new(tilt, twist, tilt))).collect();
        places
            .flat_map(|place| turns.iter().map(move |turn| (place, *turn)))
            .map(|(place, turn)| (self.at(&place, &turn), turn.norm() < 1e-9))
            .collect()
    }

    /// The probe whose window has this place (m from the phantom's middle) in its middle, turned by this vector (rad)
    /// about it: about the row's direction, the column's, and the image's normal.
    fn at(&self, place: &Vector3<f64>, turn: &Vector3<f64>) -> Pose<World, Probe> {
        let (stand, bench) = (&self.stand, self.bench);
        let upright = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(stand.axes));
        let rotation = upright * UnitQuaternion::from_scaled_axis(*turn);
        let [column, row] = [bench.size.0, bench.size.1].map(|n| n.saturating_sub(1) as f64 / 2.0);
        let middle = bench.setting.spacing.point(column, row).vector();
        let origin = stand.middle + stand.axes * place - rotation * middle;
        // FRAMES: the image's axes in the World as Stand defines them, its middle at the place asked for.
        let world_from_image: Pose<World, Image> =
            Pose::assume(Isometry3::from_parts(origin.into(), rotation));
        world_from_image * bench.probe_from_image.inverse()
    }

    /// Whether the pose shows enough and is clear of the wires, but for the arm; if not, it is counted.
    fn is_usable(&mut self, pose: &Pose<World, Probe>) -> bool {
        if View::new(self.bench, self.options).wires(pose).len() < self.wires {
            self.refused.too_few_wires += 1;
            return false;
        }
        let clear = self.is_clear(pose);
        self.refused.too_near += usize::from(!clear);
        clear
    }

    /// Whether every corner of the face is as far above the highest wire as it has to be, and no farther.
    pub(super) fn is_clear(&self, pose: &Pose<World, Probe>) -> bool {
        let ([x, y], stand) = (self.options.half_face_m, &self.stand);
        let height = |corner: Point<Probe>| {
            let off = (*pose * corner).vector() - stand.middle;
            -off.dot(&stand.axes.column(1)) - stand.top
        };
        let corners = [(x, y), (x, -y), (-x, y), (-x, -y)].map(|(x, y)| Point::new(x, y, 0.0));
        let allowed = self.options.clearance_m..=self.options.highest_m;
        corners.into_iter().all(|corner| allowed.contains(&height(corner)))
    }

    /// Whether the pose shows enough and is clear, nothing counted.
    pub(super) fn shows(&self, pose: &Pose<World, Probe>) -> bool {
        self.view().wires(pose).len() >= self.wires && self.is_clear(pose)
    }

    /// The phantom as the probe would see it.
    pub(super) const fn view(&self) -> View<'a> {
        View::new(self.bench, self.options)
    }

    pub(super) fn pose(&self, index: usize) -> Option<Pose<World, Probe>> {
        self.all.get(index).map(|candidate| candidate.pose)
    }

    pub(super) fn information(&self, index: usize) -> Information {
        self.all.get(index).map_or_else(Information::zeros, |candidate| candidate.information)
    }

    /// Those that nobody has taken and that are not known to be out of reach.
    pub(super) fn free(&self) -> impl Iterator<Item = usize> {
        let free = |c: &Candidate| !c.taken && c.reachable != Some(false);
        self.all.iter().enumerate().filter(move |(_, c)| free(c)).map(|(i, _)| i)
    }

    /// Those that are neither tilted nor turned, whether taken or not.
    pub(super) fn upright(&self) -> impl Iterator<Item = Pose<World, Probe>> {
        self.all.iter().filter(|c| c.upright && c.reachable != Some(false)).map(|c| c.pose)
    }

    /// Takes a candidate if it can be reached; a pose is asked about once.
    pub(super) fn take(&mut self, index: usize, reachable: &dyn Fn(&Pose<World, Probe>) -> bool) -> bool {
        let Some(candidate) = self.all.get_mut(index) else { return false };
        let asked = candidate.reachable.is_some();
        let can = *candidate.reachable.get_or_insert_with(|| reachable(&candidate.pose));
        candidate.taken = can;
        self.refused.unreachable += usize::from(!asked && !can);
        can
    }

    pub(super) fn give_back(&mut self, index: usize) {
        if let Some(candidate) = self.all.get_mut(index) {
            candidate.taken = false;
        }
    }
}

/// Every triple of three lists.
fn every<'a>(a: &'a [f64], b: &'a [f64], c: &'a [f64]) -> impl Iterator<Item = Vector3<f64>> + 'a {
    let pairs = a.iter().flat_map(move |x| b.iter().map(move |y| (*x, *y)));
    pairs.flat_map(move |(x, y)| c.iter().map(move |z| Vector3::new(x, y, *z)))
}

impl Stand {
    fn of(bench: &Bench<'_>) -> Result<Self, NoPlan> {
        let ends = || bench.phantom.wires.iter().flat_map(|wire| [wire.front, wire.back]);
        let axes = axes(bench).ok_or_else(|| NoPlan::NoDirection { phantom: bench.phantom.name.clone() })?;
        let along = ends().map(|end| axes.transpose() * (bench.world_from_phantom * end).vector());
        let (low, high) = along
            .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(l, h), p| {
                (l.inf(&p), h.sup(&p))
            });
        let extent = high - low;
        Ok(Self { middle: axes * (low + high) / 2.0, axes, extent, top: extent.y / 2.0 })
    }
}

/// Along a row, along a column, and along the wires: the upright image's axes in the World.
fn axes(bench: &Bench<'_>) -> Option<Matrix3<f64>> {
    let turn = bench.world_from_phantom.isometry().rotation;
    let squares = bench.phantom.wires.iter().map(|wire| turn * wire.run()).map(|run| run * run.transpose());
    let spread = squares.sum::<Matrix3<f64>>().symmetric_eigen();
    let wires: Vector3<f64> = spread.eigenvectors.column(spread.eigenvalues.imax()).into();
    let beam = bench.upright.z_axis().vector();
    let across_wires = beam - wires * wires.dot(&beam);
    // A beam within 30 degrees of the wires sees no cross-sections.
    if across_wires.norm().is_nan() || across_wires.norm() < 0.5 {
        return None;
    }
    let column = across_wires.normalize();
    let row = column.cross(&wires);
    // The array looks the way that it does when the probe stands upright, or its opposite would turn it half round.
    let wanted = (bench.upright * bench.probe_from_image).x_axis().vector();
    let row = if row.dot(&wanted) < 0.0 { -row } else { row };
    Some(Matrix3::from_columns(&[row, column, row.cross(&column)]))
}
