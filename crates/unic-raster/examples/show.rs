//! Draws a ball in a wrinkled ring of cloth from three sides, and once with an error map.
//!
//! ```text
//! cargo run --release -p unic-raster --example show -- OUTPUT.png
//! ```

use std::f32::consts::TAU;
use std::time::Instant;

use glam::Vec3;
use unic_raster::{
    Camera, Colouring, RasterError, Scene, Surface, captioned, grid, heat_colours, render, vertex_normals,
};

/// Largest error of the colour scale, metres.
const MAX_ERROR_M: f32 = 0.05;

struct Mesh {
    vertices: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "show.png".into());
    let ball = patch(48, 96, |u, v| sphere_point(u * 0.5, v));
    let cloth = patch(180, 14, cloth_point);
    let colours = heat_colours(&wrinkle_depths(&cloth), MAX_ERROR_M);
    let plain = Colouring::Solid([0.25, 0.42, 0.66]);
    let mut tiles = Vec::new();
    for (name, azimuth, colour) in [
        ("front", 0.0, plain),
        ("left", 1.2, plain),
        ("back", 3.1, plain),
        ("error", 0.5, Colouring::PerVertex(&colours)),
    ] {
        tiles.push(tile(&ball, &cloth, name, azimuth, colour)?);
    }
    grid(&tiles, 2, 8)?.save_png(&path)?;
    println!("{path}");
    Ok(())
}

fn tile(
    ball: &Mesh,
    cloth: &Mesh,
    name: &str,
    azimuth: f32,
    colour: Colouring,
) -> Result<unic_raster::Image, RasterError> {
    let ball_normals = vertex_normals(&ball.vertices, &ball.faces)?;
    let cloth_normals = vertex_normals(&cloth.vertices, &cloth.faces)?;
    let skin = Colouring::Solid([0.78, 0.70, 0.64]);
    let surfaces = [
        surface(ball, &ball_normals, skin),
        surface(cloth, &cloth_normals, colour),
    ];
    let (min, max) = (Vec3::new(-0.8, 0.0, -0.8), Vec3::new(0.8, 1.45, 0.8));
    let camera = Camera::framing(min, max, azimuth, 0.22, 1.0)?;
    let start = Instant::now();
    let mut image = render(&Scene::new(&surfaces), &camera, 800, 800)?;
    let faces = ball.faces.len() + cloth.faces.len();
    println!(
        "{name}: {faces} triangles, {:.1} ms",
        start.elapsed().as_secs_f64() * 1e3
    );
    if matches!(colour, Colouring::PerVertex(_)) {
        image.draw_colour_bar(24, 740, 260, 2, MAX_ERROR_M);
    }
    captioned(
        &image,
        &format!("{name}, azimuth {:.0} deg", azimuth.to_degrees()),
    )
}

fn surface<'a>(mesh: &'a Mesh, normals: &'a [Vec3], colour: Colouring<'a>) -> Surface<'a> {
    Surface {
        vertices: &mesh.vertices,
        faces: &mesh.faces,
        normals,
        colour,
    }
}

/// Grid of triangles over the unit square.
///
/// The front is the side from which the derivatives by u and v turn left.
fn patch(columns: u32, rows: u32, point: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let vertices = (0..=rows)
        .flat_map(|row| (0..=columns).map(move |column| (column, row)))
        .map(|(column, row)| point(column as f32 / columns as f32, row as f32 / rows as f32))
        .collect();
    let faces = (0..rows)
        .flat_map(|row| (0..columns).map(move |column| row * (columns + 1) + column))
        .flat_map(|a| [[a, a + 1, a + columns + 2], [a, a + columns + 2, a + columns + 1]])
        .collect();
    Mesh { vertices, faces }
}

/// Point on a ball of radius 0.45 m: u is half the polar angle over π from the south pole, v the
/// azimuth over 2π.
fn sphere_point(u: f32, v: f32) -> Vec3 {
    let (sin_p, cos_p) = (u * TAU).sin_cos();
    let (sin_a, cos_a) = (v * TAU).sin_cos();
    Vec3::new(0.0, 0.95, 0.0) + Vec3::new(sin_p * sin_a, -cos_p, sin_p * cos_a) * 0.45
}

/// Point on a skirt around the ball's waist, with folds that deepen towards the hem.
fn cloth_point(u: f32, v: f32) -> Vec3 {
    let (sin_a, cos_a) = (u * TAU).sin_cos();
    let drop = 1.0 - v;
    let radius = 0.46 + 0.22 * drop + fold(u) * drop * drop;
    Vec3::new(radius * sin_a, 0.98 - 0.8 * drop, radius * cos_a)
}

/// Depth of the folds at the hem, metres.
fn fold(u: f32) -> f32 {
    0.05 * (14.0 * u * TAU + (3.0 * u * TAU).sin()).sin() + 0.03 * (5.0 * u * TAU).cos()
}

fn wrinkle_depths(cloth: &Mesh) -> Vec<f32> {
    let depth = |p: &Vec3| {
        let drop = (0.98 - p.y) / 0.8;
        (Vec3::new(p.x, 0.0, p.z).length() - 0.46 - 0.22 * drop).abs()
    };
    cloth.vertices.iter().map(depth).collect()
}
