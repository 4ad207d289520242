//! What is bright and small and no wire: second echoes.

use nalgebra::Vector2;

use super::Dot;

/// How many of its spreads from a dot's centre a weaker dot counts as its second echo.
const ECHO: f64 = 3.5;

/// Leaves out dots that lie in the skirt of a stronger one (`dots` come strongest first): the wire's second echo.
pub(super) fn drop_second_echoes(dots: &mut Vec<Dot>) {
    let mut kept: Vec<Dot> = Vec::with_capacity(dots.len());
    for dot in dots.drain(..) {
        if !kept.iter().any(|stronger| in_skirt(stronger, &dot)) {
            kept.push(dot);
        }
    }
    *dots = kept;
}

fn in_skirt(stronger: &Dot, dot: &Dot) -> bool {
    let off = Vector2::from(dot.at_px) - Vector2::from(stronger.at_px);
    let Some(inverse) = stronger.spread_px2.try_inverse() else { return false };
    off.dot(&(inverse * off)) < ECHO * ECHO
}
