//! The error map of a comparison: the surface's distance from the gold standard, on the surface and laid flat, and as a
//! coloured mesh ([P1] Fig. 6, eq. 6).

use probepath_recon::{Mesh, Unrolled, unrolled};

use super::colours::{INK, SOFT, Scale};
use super::curve::nice;
use super::drawing::Drawing;
use super::picture::{Anchor, Picture};
use super::surface_picture::{Camera, From, SurfaceView, Window, flat, render};

const SIZE: (usize, usize) = (1800, 700);
const LETTERS: f64 = 24.0;
const FRONT: Window = Window { left: 90.0, top: 60.0, width: 1620.0, height: 210.0 };
const RIGHT: Window = Window { left: 90.0, top: 330.0, width: 1620.0, height: 210.0 };
/// The map's frame.
const MAP: Window = Window { left: 130.0, top: 40.0, width: 1600.0, height: 440.0 };
/// Points nearer to the middle than this part of the median radius are of a cap at an end: they have no angle.
const CAP: f64 = 0.4;

/// A distance for every point of a surface (mm), with a sign where the gold standard has an inside.
#[derive(Clone, Copy, Debug)]
pub struct ErrorMap<'a> {
    /// The surface, where it was compared.
    pub mesh: &'a Mesh,
    /// Its points' distances (mm).
    pub distance_mm: &'a [f64],
    /// Whether they are negative inside.
    pub signed: bool,
}

impl ErrorMap<'_> {
    /// Blue where the surface is too small, orange where too large; without signs from light to dark.
    fn scale(&self) -> Scale {
        let mut sizes: Vec<f64> =
            self.distance_mm.iter().map(|d| d.abs()).filter(|d| d.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        // The largest hundredth is shown as the end of the scale, or one stray point would bleach the rest.
        let most = sizes.get(sizes.len() * 99 / 100).copied().unwrap_or(1.0);
        let most = nice(most.max(1e-3));
        if self.signed { Scale::two_sided(most) } else { Scale::sequential(0.0, most) }
    }

    fn words(&self) -> &'static str {
        if self.signed {
            "distance from the gold standard, mm (negative: the surface is too small)"
        } else {
            "distance from the gold standard, mm"
        }
    }

    /// The surface with its distances as numbers and as colours.
    pub fn coloured(&self) -> Mesh {
        let name = if self.signed { "signed_distance_mm" } else { "distance_mm" };
        let scale = self.scale();
        let mut mesh = self.mesh.clone().with_scalars(name, self.distance_mm.to_vec());
        mesh.colours = self.distance_mm.iter().map(|d| scale.colour(*d)).collect();
        mesh
    }

    /// The surface in colours, from the front and from the right.
    pub fn on_surface(&self) -> Option<Picture> {
        let vertices_mm: Vec<[f64; 3]> = self.mesh.points.iter().map(|p| (p * 1e3).into()).collect();
        let (triangles, values, scale) = (&self.mesh.triangles, self.distance_mm, self.scale());
        let view = SurfaceView { vertices_mm: &vertices_mm, triangles, values, scale };
        let mut picture = Picture::filled(SIZE.0, SIZE.1, [255; 3]);
        let mut over = Drawing { size: (SIZE.0 as f64, SIZE.1 as f64), ..Drawing::default() };
        let cameras = [(From::Front, FRONT, "from the front"), (From::Right, RIGHT, "from the right")];
        let facing = cameras.map(|(from, window, _)| Camera::facing(&vertices_mm, from, window));
        let per_mm = facing.iter().flatten().map(|camera| camera.scale).fold(f64::INFINITY, f64::min);
        for (camera, (_, window, words)) in facing.into_iter().zip(cameras) {
            render(&mut picture, &view, &camera?.with_scale(per_mm));
            over.text((24.0, window.top - 18.0), words, LETTERS, Anchor::Start, SOFT);
        }
        let foot = SIZE.1 as f64 - 66.0;
        let long = nice(120.0 / per_mm.max(1e-9));
        over.line(&[(90.0, foot + 18.0), (90.0 + long * per_mm, foot + 18.0)], 4.0, INK);
        let after = (104.0 + long * per_mm, foot + 26.0);
        over.text(after, &format!("{long:.0} mm"), LETTERS, Anchor::Start, INK);
        scale.bar(&mut over, (1090.0, foot), (620.0, 20.0), self.words(), LETTERS * 0.84);
        over.paint(&mut picture, 1.0);
        Some(picture)
    }

    /// The surface cut open along the patient's back and laid flat: along it from the head, around it.
    pub fn laid_flat(&self) -> Option<Picture> {
        let places = unrolled(self.mesh);
        let length = places.iter().map(|p| p.along_m).fold(0.0, f64::max);
        let mut radii: Vec<f64> = places.iter().map(|p| p.radius_m).collect();
        radii.sort_by(f64::total_cmp);
        let least = CAP * radii.get(radii.len() / 2)?;
        let x = |p: &Unrolled| MAP.left + p.along_m / length.max(1e-9) * MAP.width;
        let corner = |k: u32| -> Option<(f64, f64, f64, f64)> {
            let p = places.get(k as usize).filter(|p| p.radius_m > least)?;
            Some((x(p), p.angle, *self.distance_mm.get(k as usize)?, 0.0))
        };
        let pieces = self.mesh.triangles.iter().filter_map(|t| {
            let [a, b, c] = t.map(corner);
            Some(side_by_side([a?, b?, c?]))
        });
        let pieces: Vec<[(f64, f64, f64); 3]> = pieces.flatten().collect();
        let mut picture = Picture::filled(SIZE.0, SIZE.1 - 60, [255; 3]);
        flat(&mut picture, &pieces, &self.scale());
        self.frame(length * 1e3).paint(&mut picture, 1.0);
        Some(picture)
    }

    fn frame(&self, length_mm: f64) -> Drawing {
        let mut over = Drawing { size: (SIZE.0 as f64, SIZE.1 as f64), ..Drawing::default() };
        let (right, foot) = (MAP.left + MAP.width, MAP.top + MAP.height);
        // What lies beyond the edges is the seam, drawn twice.
        for (top, height) in [(0.0, MAP.top), (foot, SIZE.1 as f64 - foot)] {
            let edge = [(0.0, top), (SIZE.0 as f64, top), (SIZE.0 as f64, top + height), (0.0, top + height)];
            over.area(&edge, [255; 3], 1.0);
        }
        let outline =
            [(MAP.left, MAP.top), (right, MAP.top), (right, foot), (MAP.left, foot), (MAP.left, MAP.top)];
        over.line(&outline, 1.0, SOFT);
        for (name, quarter) in [("back", 0.0), ("left", 1.0), ("front", 2.0), ("right", 3.0), ("back", 4.0)] {
            let y = MAP.top + MAP.height * quarter / 4.0;
            over.line(&[(MAP.left - 8.0, y), (MAP.left, y)], 1.5, SOFT);
            over.text((MAP.left - 16.0, y + LETTERS * 0.3), name, LETTERS, Anchor::End, SOFT);
        }
        let step = nice(length_mm / 8.0);
        for i in 0..=(length_mm / step) as usize {
            let x = MAP.left + i as f64 * step / length_mm * MAP.width;
            over.line(&[(x, foot), (x, foot + 8.0)], 1.5, SOFT);
            over.text((x, foot + 34.0), &format!("{:.0}", i as f64 * step), LETTERS, Anchor::Middle, SOFT);
        }
        over.text((MAP.left, foot + 88.0), "along the vessel, mm", LETTERS, Anchor::Start, SOFT);
        let bar = (right - 620.0, foot + 84.0);
        self.scale().bar(&mut over, bar, (620.0, 20.0), self.words(), LETTERS * 0.84);
        over
    }
}

/// A triangle on the map; one that crosses the seam is drawn at both edges. Angles run from the patient's front, so that
/// the seam is the back.
fn side_by_side(corners: [(f64, f64, f64, f64); 3]) -> Vec<[(f64, f64, f64); 3]> {
    let turn = std::f64::consts::TAU;
    let first = corners[0].1;
    let near = corners.map(|(x, angle, value, _)| {
        // Within half a turn of the first corner.
        let off = (angle - first + turn / 2.0).rem_euclid(turn) - turn / 2.0;
        (x, first + off, value)
    });
    let row = |angle: f64| MAP.top + (angle / turn + 0.5) * MAP.height;
    let place = |shift: f64| near.map(|(x, angle, value)| (x, row(angle + shift), value));
    let inside = |t: &[(f64, f64, f64); 3]| t.iter().any(|p| (MAP.top..MAP.top + MAP.height).contains(&p.1));
    [place(0.0), place(-turn)].into_iter().filter(inside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use probepath_frames::Point;

    /// A tube from the head down, 100 mm long; its front is too large by 0.2 mm, its back too small.
    fn tube() -> (Mesh, Vec<f64>) {
        let ring = |row: usize| {
            (0..24).map(move |k| {
                let angle = std::f64::consts::TAU * k as f64 / 24.0;
                Point::new(0.004 * angle.sin(), -0.004 * angle.cos(), -0.001 * row as f64)
            })
        };
        let points: Vec<_> = (0..101).flat_map(ring).collect();
        let mesh = Mesh::tube(&points, (101, 24));
        let distance = mesh.points.iter().map(|p| -p.y / 0.004 * 0.2).collect();
        (mesh, distance)
    }

    #[test]
    fn the_front_lies_in_the_middle_of_the_map_and_the_back_at_its_edges() {
        let (mesh, distance_mm) = tube();
        let map = ErrorMap { mesh: &mesh, distance_mm: &distance_mm, signed: true };
        let picture = map.laid_flat().unwrap();
        let column = (MAP.left + MAP.width * 0.37) as usize;
        let at = |part: f64| picture.pixel(column, (MAP.top + MAP.height * part) as usize);
        let (front, back, other) = (at(0.5), at(0.03), at(0.97));
        assert!(front[0] > front[2] + 60, "orange in front: {front:?}");
        assert!(back[2] > back[0] + 60 && other[2] > other[0] + 60, "blue behind: {back:?} {other:?}");
        for part in [0.1, 0.25, 0.4, 0.6, 0.75, 0.9] {
            assert_ne!(at(part), [255; 3], "a hole at {part}");
        }
    }

    #[test]
    fn the_coloured_mesh_carries_the_numbers_and_their_colours() {
        let (mesh, distance_mm) = tube();
        let map = ErrorMap { mesh: &mesh, distance_mm: &distance_mm, signed: true };
        let coloured = map.coloured();
        assert_eq!(coloured.scalars("signed_distance_mm"), Some(distance_mm.as_slice()));
        assert_eq!(coloured.colours.len(), mesh.points.len());
        assert!(coloured.colours[0][0] > coloured.colours[0][2], "the first point is in front: orange");
        assert!(map.on_surface().is_some());
    }
}
