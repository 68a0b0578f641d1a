//! Convex bodies as Wavefront OBJ: each group or object is a cell.

use std::collections::HashMap;

use ddem_core::Fault;

use super::rock_files::{ReadCell, ReadCells, wrong};

const FORMAT: &str =
    "an OBJ file has lines `v x y z` and `f 1 2 3 …`, after `g name` for each body";

/// Cells of a file: a new one begins with each group or object that has faces.
pub(super) fn cells(text: &str) -> Result<ReadCells, Fault> {
    let mut read = ReadCells::default();
    let (mut object, mut group) = (String::new(), String::new());
    let mut known: HashMap<(String, String), usize> = HashMap::new();
    for (line, number) in text.lines().zip(1..) {
        let mut words = line.split_whitespace();
        let (key, rest) = (words.next().unwrap_or_default(), words);
        let fault = |message: &str| wrong(format!("line {number}: {message}")).help(FORMAT);
        match key {
            "v" => {
                let parts: Vec<Option<f64>> = rest.take(3).map(finite).collect();
                let [Some(x), Some(y), Some(z)] = parts[..] else {
                    return Err(fault("a vertex has three numbers"));
                };
                read.points.push([x, y, z]);
            }
            "o" => object = rest.collect::<Vec<_>>().join(" "),
            "g" => group = rest.collect::<Vec<_>>().join(" "),
            "f" => {
                let corners: Option<Vec<u32>> =
                    rest.map(|word| corner(word, read.points.len())).collect();
                let corners =
                    corners.ok_or_else(|| fault("a face names vertices of the lines before it"))?;
                if corners.len() < 3 {
                    return Err(fault("a face has three corners or more"));
                }
                let own = (object.clone(), group.clone());
                let cell = *known.entry(own).or_insert_with(|| {
                    let name = if group.is_empty() { &object } else { &group };
                    read.cells.push(ReadCell { name: name.clone(), faces: Vec::new() });
                    read.cells.len() - 1
                });
                read.cells[cell].faces.push(corners);
            }
            // Normals, textures, materials, lines and comments.
            _ => {}
        }
    }
    if read.cells.is_empty() { Err(wrong("there is no face").help(FORMAT)) } else { Ok(read) }
}

fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|number: &f64| number.is_finite())
}

/// Number of a corner, from 0; negative numbers count back from the last of `n` vertices.
fn corner(word: &str, n: usize) -> Option<u32> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let index = match number {
        1.. => number - 1,
        0 => return None,
        _ => n as i64 + number,
    };
    u32::try_from(index).ok().filter(|&index| (index as usize) < n)
}
