//! PLY: text out, every encoding in.

use std::fmt::Write as _;

use nalgebra::Vector3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

use super::{Mesh, SPACE};

pub(super) fn bytes(mesh: &Mesh) -> Vec<u8> {
    let mut out = format!("ply\nformat ascii 1.0\ncomment {SPACE}\ncomment probepath lumen, mm\n");
    let _ = writeln!(out, "element vertex {}", mesh.points.len());
    out.push_str("property double x\nproperty double y\nproperty double z\n");
    if let Some((name, _)) = &mesh.values {
        let _ = writeln!(out, "property double {}", name.replace(char::is_whitespace, "_"));
    }
    let _ = write!(
        out,
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.triangles.len()
    );
    for (i, point) in mesh.points.iter().enumerate() {
        let p = point * 1e3;
        let _ = write!(out, "{} {} {}", p.x, p.y, p.z);
        if let Some((_, values)) = &mesh.values {
            let _ = write!(out, " {}", values.get(i).copied().unwrap_or_default());
        }
        out.push('\n');
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(out, "3 {a} {b} {c}");
    }
    out.into_bytes()
}

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, String> {
    plausible(bytes)?;
    let mut reader = bytes;
    let ply = Parser::<DefaultElement>::new().read_ply(&mut reader).map_err(|error| error.to_string())?;
    let vertices = ply.payload.get("vertex").ok_or("it has no vertices")?;
    let faces = ply.payload.get("face").ok_or("it has no faces")?;
    let mut mesh = Mesh::default();
    for (i, vertex) in vertices.iter().enumerate() {
        let axis = |name: &str| vertex.get(name).and_then(number).ok_or(format!("vertex {i} has no {name}"));
        mesh.points.push(Vector3::new(axis("x")?, axis("y")?, axis("z")?) * 1e-3);
    }
    for (i, face) in faces.iter().enumerate() {
        let list = face.get("vertex_indices").or_else(|| face.get("vertex_index"));
        let corners = list.and_then(indices).ok_or(format!("face {i} has no list of vertices"))?;
        // A polygon is a fan of triangles.
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            mesh.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }
    Ok(mesh)
}

/// Refuses headers that promise more elements than there are bytes: memory would be asked for before the data is.
fn plausible(bytes: &[u8]) -> Result<(), String> {
    if !bytes.starts_with(b"ply") {
        return Err("it does not begin with `ply`".into());
    }
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(4000)]).into_owned();
    for line in head.lines().filter(|line| line.starts_with("element")).take(20) {
        let count = line.split_whitespace().nth(2).and_then(|count| count.parse::<usize>().ok());
        if count.is_none_or(|count| count > bytes.len()) {
            return Err(format!("`{line}` is more than {} bytes can hold", bytes.len()));
        }
    }
    Ok(())
}

fn number(property: &Property) -> Option<f64> {
    match *property {
        Property::Float(x) => Some(f64::from(x)),
        Property::Double(x) => Some(x),
        Property::Int(x) => Some(f64::from(x)),
        Property::UInt(x) => Some(f64::from(x)),
        Property::Short(x) => Some(f64::from(x)),
        Property::UShort(x) => Some(f64::from(x)),
        _ => None,
    }
}

fn indices(property: &Property) -> Option<Vec<u32>> {
    fn all<T: Copy + TryInto<u32>>(list: &[T]) -> Option<Vec<u32>> {
        list.iter().map(|&i| i.try_into().ok()).collect()
    }
    match property {
        Property::ListInt(list) => all(list),
        Property::ListUInt(list) => all(list),
        Property::ListShort(list) => all(list),
        Property::ListUShort(list) => all(list),
        Property::ListUChar(list) => all(list),
        Property::ListChar(list) => all(list),
        _ => None,
    }
}
