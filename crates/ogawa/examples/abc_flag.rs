//! Writes an Alembic file of a waving flag: quads, texture coordinates and normals by vertex.
//!
//! ```text
//! cargo run --release -p ogawa --example abc_flag -- flag.abc [FRAMES [COLUMNS]]
//! ```

use ogawa::{ArchiveWriter, Attribute, Faces, FrameTiming, MeshDescription, Scope};
use std::error;

/// Height of the waves, metres.
const HEIGHT: f32 = 0.1;
/// Phase for each metre, radians.
const WAVE_NUMBER: f32 = 9.0;
/// Phase for each frame, radians.
const SPEED: f32 = 0.2;

fn main() -> Result<(), Box<dyn error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(path) = arguments.first() else {
        return Err("expected a file: abc_flag FILE [FRAMES [COLUMNS]]".into());
    };
    let number = |at: usize, default| arguments.get(at).map_or(Ok(default), |text| text.parse());
    let (frames, columns) = (number(1, 40)?, number(2, 12)?);
    let flag = Flag {
        columns,
        rows: columns / 2 + 1,
    };
    let timing = FrameTiming {
        fps: 25.0,
        start: 0.0,
    };
    let mut writer = ArchiveWriter::create(path, timing)?;
    let (faces, uvs) = (flag.faces()?, flag.uvs());
    let mesh = writer.add_mesh(&MeshDescription {
        name: "flag",
        vertices: uvs.len(),
        faces: &faces,
        uvs: Some(&uvs),
    })?;
    for frame in 0..frames {
        let (positions, normals) = flag.frame(frame as f32 * SPEED, &uvs.values);
        writer.push_with_normals(mesh, &positions, &normals)?;
    }
    writer.save()?;
    Ok(())
}

/// Grid of vertices, row by row from the bottom left; 1 m wide and half as high.
struct Flag {
    columns: u32,
    rows: u32,
}

impl Flag {
    fn faces(&self) -> ogawa::Result<Faces> {
        let quad = |row: u32, column: u32| {
            let first = row * self.columns + column;
            [first, first + 1, first + 1 + self.columns, first + self.columns]
        };
        let rows = 0..self.rows - 1;
        let corners: Vec<u32> = rows
            .flat_map(|row| (0..self.columns - 1).flat_map(move |column| quad(row, column)))
            .collect();
        Faces::new(vec![4; corners.len() / 4], corners)
    }

    fn uvs(&self) -> Attribute<2> {
        let (width, height) = ((self.columns - 1) as f32, (self.rows - 1) as f32);
        let vertex = |i| {
            [
                (i % self.columns) as f32 / width,
                (i / self.columns) as f32 / height,
            ]
        };
        Attribute {
            scope: Scope::Vertex,
            values: (0..self.columns * self.rows).map(vertex).collect(),
            indices: None,
        }
    }

    /// Positions and normals; the flag moves along z.
    fn frame(&self, time: f32, uvs: &[[f32; 2]]) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let vertex = |&[u, v]: &[f32; 2]| {
            let (sin, cos) = (WAVE_NUMBER * u - time).sin_cos();
            let slope = HEIGHT * WAVE_NUMBER * cos;
            let length = slope.hypot(1.0);
            ([u, v / 2.0, HEIGHT * sin], [-slope / length, 0.0, 1.0 / length])
        };
        uvs.iter().map(vertex).unzip()
    }
}
