//! Reading OBJ files.

use crate::{
    error::{Error, Result},
    foreign_formats::refuse_foreign,
};
use glam::{Vec2, Vec3};
use std::path::Path;
use unic_core::mesh::{TriMesh, Uvs};

/// Reads a mesh from an OBJ file; [`parse_obj`] describes the accepted content.
///
/// # Errors
/// No such file; those of [`parse_obj`].
pub fn read_obj(path: &Path) -> Result<TriMesh> {
    refuse_foreign(path, "an OBJ mesh")?;
    let bytes = std::fs::read(path).map_err(Error::io(path, "open"))?;
    parse_obj(path, &String::from_utf8_lossy(&bytes))
}

/// Parses the text of an OBJ file; `path` is used in messages only.
///
/// Every `v` becomes a vertex in the order of the file, including those that no face uses. A
/// polygon becomes a fan around its first corner. Texture coordinates are kept for each corner;
/// they are dropped if some face has none. Vertex colours, normals, groups, materials, lines and
/// points are skipped.
///
/// # Errors
/// The first line with a number that is not finite, a face of fewer than three corners or an index
/// out of range; a file without vertices.
pub fn parse_obj(path: &Path, text: &str) -> Result<TriMesh> {
    let mut parser = ObjParser::default();
    let mut continued = String::new();
    for (number, line) in text.lines().enumerate() {
        // A comment may follow on the same line.
        let line = line.split('#').next().unwrap_or_default();
        if let Some(start) = line.trim_end().strip_suffix('\\') {
            continued.push_str(start);
            continued.push(' ');
            continue;
        }
        // Continued lines are joined in one buffer; all others are parsed in place.
        let result = if continued.is_empty() {
            parser.line(line)
        } else {
            continued.push_str(line);
            parser.line(&std::mem::take(&mut continued))
        };
        result
            .map_err(|e| Error::content(path, format!("{} in line {}", e.expected, number + 1), e.found))?;
    }
    parser.finish(path)
}

#[derive(Default)]
struct ObjParser {
    mesh: TriMesh,
    uvs: Uvs,
}

/// Fault of one line; the caller adds path and line number.
struct LineError {
    expected: &'static str,
    found: String,
}

type LineResult<T> = std::result::Result<T, LineError>;

/// A corner of a face: zero-based indices of its vertex and its texture coordinate.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    uv: Option<u32>,
}

impl ObjParser {
    fn line(&mut self, line: &str) -> LineResult<()> {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                // Further numbers of the line, a weight or a colour, are skipped.
                let position = Vec3::from_array(numbers(&mut words)?);
                self.mesh.vertices.push(position);
            }
            Some("vt") => {
                // A one-dimensional texture leaves v out.
                let [u] = numbers(&mut words)?;
                let v = words.next().map_or(Ok(0.0), number)?;
                self.uvs.coordinates.push(Vec2::new(u, v));
            }
            Some("f") => self.face(words)?,
            _ => {}
        }
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> LineResult<()> {
        let corners: Vec<Corner> = words.map(|w| self.corner(w)).collect::<LineResult<_>>()?;
        if corners.len() < 3 {
            return Err(LineError {
                expected: "a face of three corners or more",
                found: corners.len().to_string(),
            });
        }
        let first = corners[0];
        // A fan is exact for convex polygons, which garments are modelled with.
        for pair in corners[1..].windows(2) {
            let fan = [first, pair[0], pair[1]];
            self.mesh.faces.push(fan.map(|c| c.vertex));
            if let [Some(a), Some(b), Some(c)] = fan.map(|c| c.uv) {
                self.uvs.faces.push([a, b, c]);
            }
        }
        Ok(())
    }

    /// Parses a corner: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, word: &str) -> LineResult<Corner> {
        let mut parts = word.split('/');
        let vertex = index(parts.next().unwrap_or_default(), self.mesh.vertices.len())?;
        let uv = match parts.next() {
            None | Some("") => None,
            Some(text) => Some(index(text, self.uvs.coordinates.len())?),
        };
        Ok(Corner { vertex, uv })
    }

    fn finish(self, path: &Path) -> Result<TriMesh> {
        let Self { mut mesh, uvs } = self;
        if mesh.vertices.is_empty() {
            return Err(Error::content(path, "an OBJ mesh", "no vertices"));
        }
        // Triangles without texture coordinates added none, so that equal counts mean a complete
        // map.
        if !uvs.faces.is_empty() && uvs.faces.len() == mesh.faces.len() {
            mesh.uvs = Some(uvs);
        }
        Ok(mesh)
    }
}

/// Parses an index of one of `count` elements: one-based, or counted back from the latest if
/// negative.
fn index(text: &str, count: usize) -> LineResult<u32> {
    let index = match text.parse::<i64>() {
        Ok(i) if i > 0 => Some(i - 1),
        // −1 is the last element so far.
        Ok(i) if i < 0 => i64::try_from(count).ok().map(|n| n + i),
        _ => None,
    };
    let inside = index.filter(|&i| i >= 0 && (i as u64) < count as u64);
    (inside.and_then(|i| u32::try_from(i).ok())).ok_or_else(|| LineError {
        expected: "the index of something that stands above it",
        found: format!("`{text}` with {count} above"),
    })
}

fn number(text: &str) -> LineResult<f32> {
    let value: Option<f32> = text.parse().ok();
    value.filter(|x| x.is_finite()).ok_or_else(|| LineError {
        expected: "a finite number",
        found: format!("`{text}`"),
    })
}

fn numbers<'a, const N: usize>(words: &mut impl Iterator<Item = &'a str>) -> LineResult<[f32; N]> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = number(words.next().unwrap_or_default())?;
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<TriMesh> {
        parse_obj(Path::new("a.obj"), text)
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1 0\nv 9 9 9\n";

    #[test]
    fn polygons_become_fans_and_unused_vertices_stay() {
        let mesh = parse(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
        assert_eq!(mesh.vertices.len(), 5);
        assert_eq!(mesh.vertices[1], Vec3::X);
        assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.uvs, None);
    }

    #[test]
    fn negative_indices_comments_and_continued_lines_are_read() {
        let mesh = parse(&format!("# a\n{SQUARE}\r\ng panel\nf -5 -4 \\\n  -3 # fan\n")).unwrap();
        assert_eq!(mesh.faces, [[0, 1, 2]]);
    }

    #[test]
    fn texture_coordinates_belong_to_corners() {
        let uvs = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.25 0.75 0\nvn 0 0 1\n";
        let mesh = parse(&format!("{SQUARE}{uvs}f 1/1/1 2/2/1 3/3/1\nf 1/4 3/3 4/2\n")).unwrap();
        let found = mesh.uvs.unwrap();
        assert_eq!(found.coordinates[3], Vec2::new(0.25, 0.75));
        assert_eq!(found.faces, [[0, 1, 2], [3, 2, 1]]);
        let mixed = parse(&format!("{SQUARE}{uvs}f 1/1 2/2 3/3\nf 1//1 3//1 4//1\n")).unwrap();
        assert_eq!(mixed.uvs, None);
    }

    #[test]
    fn errors_name_the_line() {
        for (line, word) in [
            ("f 1 2", "three corners"),
            ("f 1 2 7", "`7`"),
            ("f 0 1 2", "`0`"),
            ("f 1 2 -6", "`-6`"),
            ("v 1 2", "finite number"),
            ("v 1 2 nan", "`nan`"),
            ("v 1 2 1e99", "`1e99`"),
        ] {
            let message = parse(&format!("{SQUARE}{line}\n")).unwrap_err().to_string();
            assert!(message.contains("line 6") && message.contains(word), "{message}");
        }
        assert!(parse("").is_err());
    }
}
