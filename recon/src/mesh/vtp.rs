//! VTP (VTK's XML): base64 out; text, and base64 with or without zlib, in.

use std::fmt::Write as _;
use std::io::Read as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Vector3;
use roxmltree::{Document, Node};

use super::{MOST, Mesh, PointScalars};

pub(super) fn bytes(mesh: &Mesh) -> Vec<u8> {
    let (points, polygons) = (mesh.points.len(), mesh.triangles.len());
    let mut out = String::from("<?xml version=\"1.0\"?>\n<!-- probepath lumen, mm, SPACE=LPS -->\n");
    out.push_str(
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n",
    );
    // 3D Slicer reads the field.
    out.push_str("<FieldData>\n<DataArray type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">76 80 83 0</DataArray>\n</FieldData>\n");
    let _ = writeln!(
        out,
        "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{polygons}\">"
    );
    point_data(&mut out, mesh);
    let places = mesh.points.iter().flat_map(|p| (p * 1e3).iter().copied().collect::<Vec<_>>());
    out.push_str("<Points>\n");
    numbers_out(&mut out, "Float64\" NumberOfComponents=\"3", "Points", places.map(f64::to_le_bytes));
    out.push_str("</Points>\n<Polys>\n");
    let corners = mesh.triangles.iter().flatten().map(|&corner| i64::from(corner).to_le_bytes());
    numbers_out(&mut out, "Int64", "connectivity", corners);
    numbers_out(&mut out, "Int64", "offsets", (1..=polygons as i64).map(|i| (3 * i).to_le_bytes()));
    out.push_str("</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n");
    out.into_bytes()
}

fn point_data(out: &mut String, mesh: &Mesh) {
    let named = |name: &str| name.replace(['&', '<', '>', '"'], "_");
    let Some(first) = mesh.scalars.first() else { return };
    let _ = writeln!(out, "<PointData Scalars=\"{}\">", named(&first.name));
    for scalars in &mesh.scalars {
        let value = |i: usize| scalars.values.get(i).copied().unwrap_or(f64::NAN);
        let values = (0..mesh.points.len()).map(|i| value(i).to_le_bytes());
        numbers_out(out, "Float64", &named(&scalars.name), values);
    }
    out.push_str("</PointData>\n");
}

/// An array as base64, its length in bytes before it: exact, and NaN passes, which VTK's text reader stops at.
fn numbers_out(out: &mut String, kind: &str, name: &str, words: impl Iterator<Item = [u8; 8]>) {
    let mut bytes = vec![0; 8];
    words.for_each(|word| bytes.extend_from_slice(&word));
    let length = (bytes.len() as u64 - 8).to_le_bytes();
    bytes.iter_mut().zip(length).for_each(|(byte, value)| *byte = value);
    let _ = write!(out, "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"binary\">");
    STANDARD.encode_string(&bytes, out);
    out.push_str("</DataArray>\n");
}

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, String> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| "it is not text; write it with inline data, not appended raw")?;
    let document = Document::parse(text).map_err(|error| error.to_string())?;
    let file = document.root_element();
    if file.attribute("type") != Some("PolyData") {
        return Err(format!("its type is {:?}, not PolyData", file.attribute("type").unwrap_or("none")));
    }
    let space = arrays(file).find(|node| node.attribute("Name") == Some("SPACE"));
    if let Some(space) = space
        && numbers(file, space).is_ok_and(|says| says.starts_with(&[82.0, 65.0, 83.0]))
    {
        return Err("its field SPACE says RAS; convert it to LPS first (x and y change their sign)".into());
    }
    let mut mesh = Mesh::default();
    for piece in file.descendants().filter(|node| node.has_tag_name("Piece")) {
        let first = mesh.points.len() as u32;
        let points = array(file, piece, "Points", None)?;
        mesh.points.extend(points.chunks_exact(3).map(|p| Vector3::new(p[0], p[1], p[2]) * 1e-3));
        polygons(file, piece, first, &mut mesh)?;
        scalars(file, piece, &mut mesh)?;
    }
    // A number that only some pieces have is none of the mesh.
    let count = mesh.points.len();
    mesh.scalars.retain(|scalars| scalars.values.len() == count);
    Ok(mesh)
}

/// The arrays of one component that belong to the points.
fn scalars(file: Node<'_, '_>, piece: Node<'_, '_>, mesh: &mut Mesh) -> Result<(), String> {
    let data = piece.children().filter(|node| node.has_tag_name("PointData"));
    for node in data.flat_map(arrays) {
        let single = node.attribute("NumberOfComponents").is_none_or(|count| count == "1");
        let (Some(name), true, true) = (node.attribute("Name"), single, node.has_tag_name("DataArray"))
        else {
            continue;
        };
        let values = numbers(file, node).map_err(|why| format!("PointData {name}: {why}"))?;
        match mesh.scalars.iter_mut().find(|scalars| scalars.name == name) {
            Some(scalars) => scalars.values.extend(values),
            None => mesh.scalars.push(PointScalars { name: name.into(), values }),
        }
    }
    Ok(())
}

fn polygons(file: Node<'_, '_>, piece: Node<'_, '_>, first: u32, mesh: &mut Mesh) -> Result<(), String> {
    let corners = array(file, piece, "Polys", Some("connectivity"))?;
    let mut from = 0;
    for end in array(file, piece, "Polys", Some("offsets"))? {
        let end = end as usize;
        let polygon =
            corners.get(from..end).ok_or(format!("a polygon ends at {end} of {}", corners.len()))?;
        let corner = |i: usize| first + polygon[i] as u32;
        for i in 2..polygon.len() {
            mesh.triangles.push([corner(0), corner(i - 1), corner(i)]);
        }
        from = end;
    }
    Ok(())
}

fn arrays<'a, 'i: 'a>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.descendants().filter(|node| node.has_tag_name("DataArray") || node.has_tag_name("Array"))
}

fn array(
    file: Node<'_, '_>,
    piece: Node<'_, '_>,
    group: &str,
    name: Option<&str>,
) -> Result<Vec<f64>, String> {
    let group_node =
        piece.children().find(|node| node.has_tag_name(group)).ok_or(format!("it has no {group}"))?;
    let found = arrays(group_node).find(|node| name.is_none() || node.attribute("Name") == name);
    let node = found.ok_or(format!("{group} has no {}", name.unwrap_or("array")))?;
    numbers(file, node).map_err(|why| format!("{group} {}: {why}", name.unwrap_or_default()))
}

fn numbers(file: Node<'_, '_>, array: Node<'_, '_>) -> Result<Vec<f64>, String> {
    let text = array.text().unwrap_or_default();
    match array.attribute("format") {
        Some("ascii") | None => text
            .split_whitespace()
            .map(|word| word.parse().map_err(|_| format!("`{word}` is no number")))
            .collect(),
        Some("binary") => decode(&payload(file, text.trim())?, array.attribute("type").unwrap_or("none")),
        Some(other) => Err(format!("format {other} is not read; write it inline (binary or ascii)")),
    }
}

/// The bytes behind base64: a header of lengths, then the data, in blocks of zlib when the file says so.
fn payload(file: Node<'_, '_>, text: &str) -> Result<Vec<u8>, String> {
    let wide = file.attribute("header_type") == Some("UInt64");
    let size = if wide { 8 } else { 4 };
    let word = |bytes: &[u8], i: usize| -> Option<usize> {
        let mut word = [0_u8; 8];
        word[..size].copy_from_slice(bytes.get(i * size..(i + 1) * size)?);
        usize::try_from(u64::from_le_bytes(word)).ok()
    };
    if file.attribute("byte_order") == Some("BigEndian") {
        return Err("big-endian data is not read".into());
    }
    let bad = |error: base64::DecodeError| error.to_string();
    let cut = || "its data is cut short".to_string();
    match file.attribute("compressor") {
        None => {
            let bytes = STANDARD.decode(text).map_err(bad)?;
            Ok(bytes.get(size..).ok_or_else(cut)?.to_vec())
        }
        Some("vtkZLibDataCompressor") => {
            // The header is encoded by itself: count, size, last size, then one length a block.
            let start = STANDARD.decode(text.get(..encoded(3 * size)).ok_or_else(cut)?).map_err(bad)?;
            let blocks = word(&start, 0).filter(|&blocks| blocks < MOST).ok_or_else(cut)?;
            let head = encoded((3 + blocks) * size);
            let lengths = STANDARD.decode(text.get(..head).ok_or_else(cut)?).map_err(bad)?;
            let data = STANDARD.decode(text.get(head..).ok_or_else(cut)?).map_err(bad)?;
            let mut out = Vec::new();
            let mut from = 0_usize;
            for block in 0..blocks {
                let length = word(&lengths, 3 + block).ok_or_else(cut)?;
                let part = from.checked_add(length).and_then(|end| data.get(from..end)).ok_or_else(cut)?;
                let room = 24 * MOST as u64;
                flate2::read::ZlibDecoder::new(part)
                    .take(room)
                    .read_to_end(&mut out)
                    .map_err(|error| error.to_string())?;
                from += length;
            }
            Ok(out)
        }
        Some(other) => Err(format!("compressor {other} is not read; use zlib or none")),
    }
}

/// Characters of base64 for so many bytes.
const fn encoded(bytes: usize) -> usize {
    bytes.div_ceil(3) * 4
}

fn decode(bytes: &[u8], kind: &str) -> Result<Vec<f64>, String> {
    fn each<const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        bytes.as_chunks::<N>().0.iter().map(|word| number(*word)).collect()
    }
    Ok(match kind {
        "Float32" => each(bytes, |b| f64::from(f32::from_le_bytes(b))),
        "Float64" => each(bytes, f64::from_le_bytes),
        "Int32" => each(bytes, |b| f64::from(i32::from_le_bytes(b))),
        "UInt32" => each(bytes, |b| f64::from(u32::from_le_bytes(b))),
        "Int64" => each(bytes, |b| i64::from_le_bytes(b) as f64),
        "UInt64" => each(bytes, |b| u64::from_le_bytes(b) as f64),
        "UInt8" | "Int8" | "String" => each(bytes, |[b]: [u8; 1]| f64::from(b)),
        other => return Err(format!("numbers of type {other} are not read")),
    })
}
