//! STL: binary out; text and binary in. By hand, because the axes belong in the header, which libraries fill.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::{MOST, Mesh, SPACE};

/// Bytes before the count.
const HEADER: usize = 80;
/// Bytes a triangle.
const TRIANGLE: usize = 50;

pub(super) fn bytes(mesh: &Mesh) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEADER + 4 + TRIANGLE * mesh.triangles.len());
    out.extend_from_slice(format!("{:<HEADER$}", format!("probepath lumen, mm, {SPACE}")).as_bytes());
    out.extend_from_slice(&(mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        let [a, b, c] = mesh.corners(triangle);
        let normal = (b - a).cross(&(c - a)).try_normalize(1e-30).unwrap_or_default();
        for vector in [normal, a * 1e3, b * 1e3, c * 1e3] {
            vector.iter().for_each(|&x| out.extend_from_slice(&(x as f32).to_le_bytes()));
        }
        out.extend_from_slice(&[0, 0]);
    }
    out
}

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, String> {
    let count = bytes
        .get(HEADER..HEADER + 4)
        .map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]));
    if let Some(count) = count
        && bytes.len() == HEADER + 4 + TRIANGLE * count as usize
    {
        return Ok(binary(&bytes[HEADER + 4..]));
    }
    if bytes.trim_ascii_start().starts_with(b"solid") {
        return text(bytes);
    }
    let says = count.map_or_else(|| "no count".into(), |count| format!("{count} triangles"));
    Err(format!("it says {says}, and has {} bytes (cut short, or another format)", bytes.len()))
}

fn binary(bytes: &[u8]) -> Mesh {
    let mut welder = Welder::default();
    for triangle in bytes.chunks_exact(TRIANGLE) {
        let number = |i: usize| {
            let at = 12 + 4 * i;
            f32::from_le_bytes([triangle[at], triangle[at + 1], triangle[at + 2], triangle[at + 3]])
        };
        welder.triangle([0, 3, 6].map(|i| [number(i), number(i + 1), number(i + 2)]));
    }
    welder.mesh
}

fn text(bytes: &[u8]) -> Result<Mesh, String> {
    let text = std::str::from_utf8(bytes).map_err(|error| error.to_string())?;
    let mut welder = Welder::default();
    let mut corners = Vec::new();
    for (line, words) in text.lines().enumerate() {
        let mut words = words.split_whitespace();
        match words.next() {
            Some("vertex") => {
                let numbers: Vec<f32> = words.map_while(|word| word.parse().ok()).collect();
                let [x, y, z] = numbers[..] else {
                    return Err(format!("line {}: a vertex has three numbers", line + 1));
                };
                corners.push([x, y, z]);
            }
            Some("endfacet") => {
                let [a, b, c] = corners[..] else {
                    return Err(format!("line {}: a facet has three vertices", line + 1));
                };
                welder.triangle([a, b, c]);
                corners.clear();
            }
            _ => {}
        }
    }
    if !text.trim_end().lines().last().is_some_and(|line| line.trim_start().starts_with("endsolid")) {
        return Err("it ends before its endsolid (cut short)".into());
    }
    Ok(welder.mesh)
}

/// STL repeats every point in every triangle: the same numbers are the same point.
#[derive(Default)]
struct Welder {
    mesh: Mesh,
    known: HashMap<[u32; 3], u32>,
}

impl Welder {
    fn triangle(&mut self, corners: [[f32; 3]; 3]) {
        if self.mesh.triangles.len() >= MOST {
            return;
        }
        let triangle = corners.map(|corner| {
            // -0 and 0 are one place.
            let key = corner.map(|x| (x + 0.0).to_bits());
            let next = self.mesh.points.len() as u32;
            *self.known.entry(key).or_insert_with(|| {
                self.mesh.points.push(Vector3::from(corner.map(f64::from)) * 1e-3);
                next
            })
        });
        self.mesh.triangles.push(triangle);
    }
}
