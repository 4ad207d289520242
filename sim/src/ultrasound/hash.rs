//! Numbers that belong to a place: the same at every visit, unrelated to its neighbours'.

/// Mixes all 64 bits (the finaliser of splitmix64, Steele 2014).
pub(super) const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// What a step along each axis adds before mixing: odd, and unrelated in every sum of small multiples.
pub(super) const STEPS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0xd6e8_feb8_6659_fd93];

/// The hash of a cell of a lattice.
pub(super) const fn cell(seed: u64, i: i64, j: i64, k: i64) -> u64 {
    let along = (i as u64).wrapping_mul(STEPS[0]);
    let across = (j as u64).wrapping_mul(STEPS[1]);
    mix(seed.wrapping_add(along).wrapping_add(across).wrapping_add((k as u64).wrapping_mul(STEPS[2])))
}

/// Smooth noise fixed in space: mean 0, standard deviation about 1, over cubes of edge one.
pub(super) fn smooth(seed: u64, p: [f64; 3]) -> f64 {
    let base = p.map(f64::floor);
    let ease = |i: usize| {
        let t = p[i] - base[i];
        t * t * (3.0 - 2.0 * t)
    };
    let (tx, ty, tz) = (ease(0), ease(1), ease(2));
    let corner = |dx: i64, dy: i64, dz: i64| {
        let bits = cell(seed, base[0] as i64 + dx, base[1] as i64 + dy, base[2] as i64 + dz);
        (bits >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let along_x = |dy, dz| corner(0, dy, dz) * (1.0 - tx) + corner(1, dy, dz) * tx;
    let along_y = |dz| along_x(0, dz) * (1.0 - ty) + along_x(1, dz) * ty;
    // Uniform corners have a deviation of 0.289; blending three times leaves 0.4 of it on average.
    (along_y(0) * (1.0 - tz) + along_y(1) * tz) * 7.0
}
