//! How much the probe turned and moved while the images were taken.

use nalgebra::Vector3;

use super::problem::Problem;

/// What the poses of the images span.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    /// From the least to the greatest angle about each of the probe's axes (rad).
    pub(super) turned_rad: Vector3<f64>,
    /// Root mean square speed of the probe (m/s).
    pub(super) speed_m_s: f64,
}

pub(super) fn of(problem: &Problem<'_>) -> Spread {
    let inside = problem.images.iter().filter(|i| i.inside);
    let moments: Vec<_> = inside.map(|image| image.moment).collect();
    let Some(first) = moments.get(moments.len() / 2) else {
        return Spread { turned_rad: Vector3::zeros(), speed_m_s: 0.0 };
    };
    let home = first.world_from_probe.isometry().rotation.inverse();
    let (mut least, mut most) = (Vector3::zeros(), Vector3::zeros());
    let mut speed = 0.0;
    for moment in &moments {
        let turn = (home * moment.world_from_probe.isometry().rotation).scaled_axis();
        (least, most) = (least.inf(&turn), most.sup(&turn));
        speed += moment.twist.linear.norm_squared();
    }
    Spread { turned_rad: most - least, speed_m_s: (speed / moments.len() as f64).sqrt() }
}
