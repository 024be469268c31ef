//! Draws the three complex garments from several sides.
//!
//! ```text
//! cargo run --release -p unic-builtin --example complex_pictures -- FOLDER [CHARACTER.npz]
//! ```

use glam::Vec3;
use std::{error::Error, path::Path, time::Instant};
use unic_builtin::garments::{GarmentMesh, PleatedDress, Robe, TulleSkirt};
use unic_core::character::Character;
use unic_raster::{Camera, Colouring, Image, Scene, Surface, grid, render, vertex_normals};

/// Colour of the body, sRGB.
const BODY: [f32; 3] = [0.78, 0.70, 0.64];

/// Colours of the parts in turn, sRGB.
const CLOTH: [[f32; 3]; 8] = [
    [0.35, 0.47, 0.66],
    [0.75, 0.45, 0.45],
    [0.50, 0.64, 0.48],
    [0.84, 0.70, 0.43],
    [0.58, 0.48, 0.66],
    [0.42, 0.64, 0.66],
    [0.70, 0.33, 0.37],
    [0.86, 0.60, 0.60],
];

/// Azimuth of each view, radians from the front.
const AZIMUTHS: [f32; 4] = [0.0, 0.8, 1.5, 3.3];

/// Elevation of all views, radians.
const ELEVATION: f32 = 0.1;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments
        .next()
        .ok_or("usage: complex_pictures FOLDER [CHARACTER.npz]")?;
    let folder = Path::new(&folder);
    let character = match arguments.next() {
        Some(path) => unic_io::read_character(Path::new(&path))?,
        None => unic_builtin::human::human(&Default::default())?,
    };
    std::fs::create_dir_all(folder)?;
    draw(folder, "pleated_dress", &character, || {
        PleatedDress::default().make(&character)
    })?;
    draw(folder, "tulle_skirt", &character, || {
        TulleSkirt::default().make(&character)
    })?;
    draw(folder, "robe", &character, || Robe::default().make(&character))
}

fn draw<E: Error + 'static>(
    folder: &Path,
    name: &str,
    character: &Character,
    make: impl Fn() -> Result<GarmentMesh, E>,
) -> Result<(), Box<dyn Error>> {
    let begin = Instant::now();
    let garment = make()?;
    let seconds = begin.elapsed().as_secs_f32();
    println!(
        "{name}: {} vertices in {seconds:.2} s",
        garment.mesh.vertices.len()
    );
    let views = AZIMUTHS.map(|azimuth| view(character, &garment, azimuth));
    let views = views.into_iter().collect::<Result<Vec<_>, _>>()?;
    grid(&views, 2, 8)?.save_png(folder.join(format!("{name}.png")))?;
    Ok(())
}

fn view(character: &Character, garment: &GarmentMesh, azimuth: f32) -> Result<Image, Box<dyn Error>> {
    let body = &character.body;
    let cloth = &garment.mesh;
    let colours: Vec<[f32; 3]> = (garment.part_of_vertex.iter())
        .map(|&part| CLOTH[part as usize % CLOTH.len()])
        .collect();
    let surfaces = [
        Surface {
            vertices: &body.vertices,
            faces: &body.faces,
            normals: &vertex_normals(&body.vertices, &body.faces)?,
            colour: Colouring::Solid(BODY),
        },
        Surface {
            vertices: &cloth.vertices,
            faces: &cloth.faces,
            normals: &vertex_normals(&cloth.vertices, &cloth.faces)?,
            colour: Colouring::PerVertex(&colours),
        },
    ];
    let low = cloth.vertices.iter().fold(Vec3::MAX, |low, v| low.min(*v));
    let high = cloth.vertices.iter().fold(Vec3::MIN, |high, v| high.max(*v));
    let margin = Vec3::splat(0.03);
    let camera = Camera::framing(low - margin, high + margin, azimuth, ELEVATION, 1.0)?;
    Ok(render(&Scene::new(&surfaces), &camera, 900, 900)?)
}
