//! PLY: binary out (exact, and NaN has a place in it), every encoding in.

use std::fmt::Write as _;

use nalgebra::Vector3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

use super::{Mesh, PointScalars, SPACE};

pub(super) fn bytes(mesh: &Mesh) -> Vec<u8> {
    let mut head = format!("ply\nformat binary_little_endian 1.0\ncomment {SPACE}\n");
    let _ = write!(head, "comment probepath lumen, mm\nelement vertex {}\n", mesh.points.len());
    head.push_str("property double x\nproperty double y\nproperty double z\n");
    if !mesh.colours.is_empty() {
        head.push_str("property uchar red\nproperty uchar green\nproperty uchar blue\n");
    }
    for scalars in &mesh.scalars {
        let _ = writeln!(head, "property double {}", scalars.name.replace(char::is_whitespace, "_"));
    }
    let faces = mesh.triangles.len();
    let _ = write!(head, "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n");
    let mut out = head.into_bytes();
    (0..mesh.points.len()).for_each(|i| vertex(&mut out, mesh, i));
    for triangle in &mesh.triangles {
        out.push(3);
        triangle.iter().for_each(|corner| out.extend_from_slice(&corner.to_le_bytes()));
    }
    out
}

fn vertex(out: &mut Vec<u8>, mesh: &Mesh, i: usize) {
    let place = mesh.points.get(i).copied().unwrap_or_default() * 1e3;
    place.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    if !mesh.colours.is_empty() {
        out.extend_from_slice(&mesh.colours.get(i).copied().unwrap_or_default());
    }
    for scalars in &mesh.scalars {
        out.extend_from_slice(&scalars.values.get(i).copied().unwrap_or(f64::NAN).to_le_bytes());
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, String> {
    plausible(bytes)?;
    let mut reader = bytes;
    // The parser says it in several lines.
    let one_line = |said: String| said.split_whitespace().collect::<Vec<_>>().join(" ");
    let ply =
        Parser::<DefaultElement>::new().read_ply(&mut reader).map_err(|error| one_line(error.to_string()))?;
    let vertices = ply.payload.get("vertex").ok_or("it has no vertices")?;
    let faces = ply.payload.get("face").ok_or("it has no faces")?;
    let mut mesh = Mesh::default();
    let named = vertices.first().map(scalar_names).unwrap_or_default();
    mesh.scalars = named.into_iter().map(|name| PointScalars { name, values: Vec::new() }).collect();
    for (i, vertex) in vertices.iter().enumerate() {
        let axis = |name: &str| vertex.get(name).and_then(number).ok_or(format!("vertex {i} has no {name}"));
        mesh.points.push(Vector3::new(axis("x")?, axis("y")?, axis("z")?) * 1e-3);
        for scalars in &mut mesh.scalars {
            scalars.values.push(vertex.get(&scalars.name).and_then(number).unwrap_or(f64::NAN));
        }
        mesh.colours.extend(colour(vertex));
    }
    if mesh.colours.len() != mesh.points.len() {
        mesh.colours.clear();
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

/// What a vertex has beyond its place and colour.
fn scalar_names(vertex: &DefaultElement) -> Vec<String> {
    let known = ["x", "y", "z", "red", "green", "blue", "alpha", "nx", "ny", "nz"];
    let named =
        vertex.iter().filter(|(name, value)| !known.contains(&name.as_str()) && number(value).is_some());
    named.map(|(name, _)| name.clone()).collect()
}

fn colour(vertex: &DefaultElement) -> Option<[u8; 3]> {
    let channel = |name: &str| match vertex.get(name) {
        Some(Property::UChar(level)) => Some(*level),
        _ => None,
    };
    Some([channel("red")?, channel("green")?, channel("blue")?])
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
        Property::Char(x) => Some(f64::from(x)),
        Property::UChar(x) => Some(f64::from(x)),
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
