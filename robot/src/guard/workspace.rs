use probepath_frames::{Base, Direction, Point};

/// A plane that the probe's origin stays on one side of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point on it.
    pub through: Point<Base>,
    /// Its normal, toward the side where the probe may be.
    pub inward: Direction<Base>,
}

/// Where the probe's origin may be: on the inner side of every plane. No plane, no bound. The
/// guard stops the arm while the brake still ends inside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Workspace {
    planes: Vec<Plane>,
}

impl Workspace {
    /// Without bounds.
    pub fn new() -> Self {
        Self::default()
    }

    /// A box in the base's axes, `low` and `high` being opposite corners.
    pub fn between(low: Point<Base>, high: Point<Base>) -> Self {
        let axes = [Direction::x(), Direction::y(), Direction::z()];
        let sides = axes.into_iter().flat_map(|inward| {
            [Plane { through: low, inward }, Plane { through: high, inward: inward.reversed() }]
        });
        Self { planes: sides.collect() }
    }

    /// Also on the inner side of this plane: the table, a wall.
    #[must_use]
    pub fn and(mut self, plane: Plane) -> Self {
        self.planes.push(plane);
        self
    }

    /// The planes, in order.
    pub fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// The first plane that `next` lies beyond, and further beyond than `now` does; and by how much (m).
    pub fn crossed(&self, next: &Point<Base>, now: &Point<Base>) -> Option<(usize, f64)> {
        let beyond = |plane: &Plane, point: &Point<Base>| {
            (plane.through.vector() - point.vector()).dot(&plane.inward.vector())
        };
        let further = |plane: &Plane| beyond(plane, next) > beyond(plane, now).max(0.0);
        let (number, plane) = self.planes.iter().enumerate().find(|(_, plane)| further(plane))?;
        Some((number, beyond(plane, next)))
    }
}
