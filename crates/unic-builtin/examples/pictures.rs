//! Draws the procedural human in several poses, and the two simple garments.
//!
//! ```text
//! cargo run --release -p unic-builtin --example pictures -- FOLDER
//! ```

use glam::Vec3;
use std::{error::Error, f32::consts::PI, path::Path, time::Instant};
use unic_builtin::{
    garments::{FlaredSkirt, GarmentMesh, TShirt},
    human::{HumanParameters, human},
};
use unic_core::{Pose, character::Character};
use unic_raster::{Camera, Colouring, Image, Scene, Surface, captioned, grid, render, vertex_normals};

/// Side of a tile, pixels.
const TILE: u32 = 640;

/// Colour of the body, sRGB.
const SKIN: [f32; 3] = [0.80, 0.70, 0.62];

/// A mesh to draw in one sRGB colour.
#[derive(Clone, Copy)]
struct ColouredMesh<'a> {
    vertices: &'a [Vec3],
    faces: &'a [[u32; 3]],
    colour: [f32; 3],
}

/// Box around a part of a scene, metres.
#[derive(Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let start = Instant::now();
    let character = human(&HumanParameters::default())?;
    let (vertices, faces) = (character.body.vertices.len(), character.body.faces.len());
    println!(
        "human: {vertices} vertices, {faces} faces, {:.2} s",
        start.elapsed().as_secs_f64()
    );
    rest_sheet(&character)?.save_png(folder.join("human.png"))?;
    close_ups(&character)?.save_png(folder.join("human_close.png"))?;
    pose_sheet(&character)?.save_png(folder.join("human_poses.png"))?;
    let mut bodies = vec![("built-in", character)];
    let real = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/body/character.npz");
    if real.exists() {
        bodies.push(("real", unic_io::read_character(&real)?));
    }
    for (name, character) in &bodies {
        for garment_name in ["tshirt", "skirt"] {
            let start = Instant::now();
            let garment = match garment_name {
                "tshirt" => TShirt::default().make(character)?,
                _ => FlaredSkirt::default().make(character)?,
            };
            let (vertices, seconds) = (garment.mesh.vertices.len(), start.elapsed().as_secs_f64());
            println!("{garment_name} on {name}: {vertices} vertices, {seconds:.2} s");
            let sheet = garment_sheet(character, &garment)?;
            sheet.save_png(folder.join(format!("{garment_name}_{name}.png")))?;
        }
    }
    Ok(())
}

/// Colours of the parts in turn, sRGB.
const CLOTH: [[f32; 3]; 4] = [
    [0.30, 0.45, 0.68],
    [0.36, 0.54, 0.78],
    [0.72, 0.42, 0.36],
    [0.80, 0.60, 0.32],
];

fn garment_sheet(character: &Character, garment: &GarmentMesh) -> Result<Image, Box<dyn Error>> {
    let (body, mesh) = (&character.body, &garment.mesh);
    let mut tiles = Vec::new();
    for (name, azimuth) in [("front", 0.2), ("left", 1.3), ("back", 3.4)] {
        let mut meshes = vec![skin(&body.vertices, &body.faces)];
        let panels = panels(garment);
        for (part, faces) in panels.iter().enumerate() {
            meshes.push(ColouredMesh {
                vertices: &mesh.vertices,
                faces,
                colour: CLOTH[part % CLOTH.len()],
            });
        }
        tiles.push(picture(&meshes, bounds(&mesh.vertices), azimuth, name)?);
    }
    tiles.push(pattern_picture(garment)?);
    Ok(grid(&tiles, 2, 4)?)
}

fn skin<'a>(vertices: &'a [Vec3], faces: &'a [[u32; 3]]) -> ColouredMesh<'a> {
    ColouredMesh {
        vertices,
        faces,
        colour: SKIN,
    }
}

/// Faces of each part.
///
/// A vertex on a seam belongs to the part with the lower index. The largest index of a face's
/// corners is therefore its part.
fn panels(garment: &GarmentMesh) -> Vec<Vec<[u32; 3]>> {
    let mut panels = vec![Vec::new(); garment.parts.len()];
    for face in &garment.mesh.faces {
        let part = face.map(|v| garment.part_of_vertex[v as usize]).into_iter().max();
        panels[part.unwrap_or(0) as usize].push(*face);
    }
    panels
}

/// Picture of the pattern with shrunk triangles, so that each can be seen.
fn pattern_picture(garment: &GarmentMesh) -> Result<Image, Box<dyn Error>> {
    let uvs = garment.mesh.uvs.as_ref().ok_or("a garment without a pattern")?;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for corners in &uvs.faces {
        let places = corners.map(|c| uvs.coordinates[c as usize].extend(0.0));
        let middle = places.iter().sum::<Vec3>() / 3.0;
        let first = vertices.len() as u32;
        vertices.extend(places.map(|p| p.lerp(middle, 0.2)));
        faces.push([first, first + 1, first + 2]);
    }
    let pattern = ColouredMesh {
        vertices: &vertices,
        faces: &faces,
        colour: CLOTH[0],
    };
    picture(&[pattern], bounds(&vertices), 0.0, "pattern")
}

fn rest_sheet(character: &Character) -> Result<Image, Box<dyn Error>> {
    let rest = &character.body.vertices;
    let views = [
        ("front", 0.0),
        ("three quarters", 0.7),
        ("left", 1.571),
        ("back", PI),
    ];
    let tile = |(name, azimuth): (&str, f32)| -> Result<Image, Box<dyn Error>> {
        picture(&[skin(rest, &character.body.faces)], bounds(rest), azimuth, name)
    };
    let tiles: Vec<Image> = views.into_iter().map(tile).collect::<Result<_, _>>()?;
    Ok(grid(&tiles, 2, 4)?)
}

fn close_ups(character: &Character) -> Result<Image, Box<dyn Error>> {
    let rest = &character.body.vertices;
    let [head, hand, foot] = [15, 22, 7].map(|j| character.skeleton.joints()[j]);
    let between = |low: Vec3, high: Vec3| Bounds { low, high };
    let around = |p: Vec3, r: f32| between(p - Vec3::splat(r), p + Vec3::splat(r));
    let views = [
        ("head", around(head + Vec3::Y * 0.04, 0.11), 0.0),
        ("head from the side", around(head + Vec3::Y * 0.04, 0.11), 1.2),
        ("hand", around(hand, 0.09), 0.4),
        ("foot", around(foot + Vec3::Z * 0.05, 0.12), 0.9),
        (
            "shoulders",
            between(Vec3::new(-0.3, 1.1, -0.2), Vec3::new(0.3, 1.6, 0.2)),
            0.3,
        ),
        (
            "hips",
            between(Vec3::new(-0.25, 0.65, -0.2), Vec3::new(0.25, 1.15, 0.2)),
            2.7,
        ),
    ];
    let mut tiles = Vec::new();
    for (name, bounds, azimuth) in views {
        let body = skin(rest, &character.body.faces);
        tiles.push(picture(&[body], bounds, azimuth, name)?);
    }
    Ok(grid(&tiles, 2, 4)?)
}

/// Rotations (axis-angle, radians) of some joints, by SMPL's index.
type Turns = [(usize, [f32; 3])];

fn pose_sheet(character: &Character) -> Result<Image, Box<dyn Error>> {
    let poses: [(&str, &Turns, f32); 8] = [
        ("arms down", &[(16, [0.0, 0.0, -1.2]), (17, [0.0, 0.0, 1.2])], 0.4),
        (
            "arms up",
            &[
                (13, [0.0, 0.0, 0.3]),
                (14, [0.0, 0.0, -0.3]),
                (16, [0.0, 0.0, 1.0]),
                (17, [0.0, 0.0, -1.0]),
            ],
            0.2,
        ),
        (
            "elbows",
            &[(18, [0.0, -1.571, 0.0]), (19, [0.0, 1.571, 0.0])],
            0.4,
        ),
        (
            "sitting",
            &[
                (1, [-1.571, 0.0, 0.0]),
                (2, [-1.571, 0.0, 0.0]),
                (4, [1.571, 0.0, 0.0]),
                (5, [1.571, 0.0, 0.0]),
                (16, [0.0, 0.0, -1.1]),
                (17, [0.0, 0.0, 1.1]),
            ],
            0.8,
        ),
        (
            "sitting from behind",
            &[
                (1, [-1.571, 0.0, 0.0]),
                (2, [-1.571, 0.0, 0.0]),
                (4, [1.571, 0.0, 0.0]),
                (5, [1.571, 0.0, 0.0]),
            ],
            2.5,
        ),
        (
            "stride",
            &[
                (1, [-0.7, 0.0, 0.0]),
                (2, [0.5, 0.0, 0.0]),
                (4, [0.4, 0.0, 0.0]),
                (5, [0.7, 0.0, 0.0]),
                (16, [0.5, 0.0, -1.2]),
                (17, [-0.5, 0.0, 1.2]),
                (18, [0.0, -0.5, 0.0]),
                (19, [0.0, 0.5, 0.0]),
            ],
            0.9,
        ),
        (
            "knee up",
            &[
                (1, [-1.9, 0.0, 0.2]),
                (4, [1.571, 0.0, 0.0]),
                (7, [0.4, 0.0, 0.0]),
                (16, [0.0, 0.0, -1.0]),
                (17, [0.0, 0.0, 1.0]),
            ],
            -0.6,
        ),
        (
            "bent and twisted",
            &[
                (3, [0.4, 0.3, 0.0]),
                (6, [0.3, 0.3, 0.0]),
                (9, [0.2, 0.2, 0.0]),
                (12, [-0.3, 0.3, 0.0]),
                (16, [0.0, -0.7, -0.4]),
                (17, [0.0, 0.5, 0.9]),
            ],
            0.5,
        ),
    ];
    let mut tiles = Vec::new();
    for (name, turns, azimuth) in poses {
        let posed = posed(character, turns);
        let body = skin(&posed, &character.body.faces);
        tiles.push(picture(&[body], bounds(&posed), azimuth, name)?);
    }
    Ok(grid(&tiles, 4, 4)?)
}

fn posed(character: &Character, turns: &Turns) -> Vec<Vec3> {
    let mut axis_angles = vec![Vec3::ZERO; 24];
    turns.iter().for_each(|&(j, turn)| axis_angles[j] = turn.into());
    let pose = Pose::from_axis_angles(Vec3::ZERO, &axis_angles);
    let (mut world_from_joint, mut world_from_rest, mut out) = (Vec::new(), Vec::new(), Vec::new());
    character
        .skeleton
        .forward_kinematics(&pose, &mut world_from_joint);
    character
        .skeleton
        .world_from_rest(&world_from_joint, &mut world_from_rest);
    character
        .weights
        .skin(&character.body.vertices, &world_from_rest, &mut out);
    out
}

fn bounds(vertices: &[Vec3]) -> Bounds {
    Bounds {
        low: vertices.iter().fold(Vec3::MAX, |low, v| low.min(*v)),
        high: vertices.iter().fold(Vec3::MIN, |high, v| high.max(*v)),
    }
}

fn picture(
    meshes: &[ColouredMesh],
    bounds: Bounds,
    azimuth: f32,
    name: &str,
) -> Result<Image, Box<dyn Error>> {
    let normals: Vec<Vec<Vec3>> = meshes
        .iter()
        .map(|mesh| vertex_normals(mesh.vertices, mesh.faces))
        .collect::<Result<_, _>>()?;
    let surfaces: Vec<Surface> = (meshes.iter().zip(&normals))
        .map(|(mesh, normals)| Surface {
            vertices: mesh.vertices,
            faces: mesh.faces,
            normals,
            colour: Colouring::Solid(mesh.colour),
        })
        .collect();
    let camera = Camera::framing(bounds.low, bounds.high, azimuth, 0.08, 1.0)?;
    Ok(captioned(
        &render(&Scene::new(&surfaces), &camera, TILE, TILE)?,
        name,
    )?)
}
