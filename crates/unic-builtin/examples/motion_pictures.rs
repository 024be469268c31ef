//! Draws strips of built-in motion on the built-in human or on a character from a file.
//!
//! ```text
//! cargo run --release -p unic-builtin --example motion_pictures -- \
//!     FOLDER [CHARACTER.npz] [CLIP]...
//! ```

use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_builtin::human::{HumanParameters, human};
use unic_builtin::motion::{Performer, standard_set};
use unic_core::{Pose, character::Character, clip::Clip};
use unic_raster::{
    Camera, Colouring, Image, RasterError, Scene, Surface, captioned, grid, render, vertex_normals,
};

/// Seed of the motions.
const SEED: u64 = 7;

const FPS: f32 = 30.0;

/// Part of a clip that is drawn as a strip of pictures.
#[derive(Clone, Copy)]
struct Strip {
    clip: &'static str,
    /// Time of the first picture, seconds.
    start: f32,
    /// Time between pictures, seconds.
    interval: f32,
    /// Direction of the view, radians from the front.
    azimuth: f32,
}

const fn strip(clip: &'static str, start: f32, interval: f32, azimuth: f32) -> Strip {
    Strip {
        clip,
        start,
        interval,
        azimuth,
    }
}

const STRIPS: [Strip; 14] = [
    strip("idle", 4.0, 1.2, 0.3),
    strip("walk_speeds", 0.0, 0.2, 1.57),
    strip("walk_speeds", 18.0, 0.0938, 1.57),
    strip("walk_speeds", 18.0, 0.0938, 0.0),
    strip("walk_circles", 4.0, 0.2, 0.4),
    strip("walk_starts_stops", 3.4, 0.2, 1.3),
    strip("run_speeds", 8.0, 0.0625, 1.57),
    strip("run_speeds", 22.0, 0.0625, 1.57),
    strip("run_speeds", 12.0, 0.0625, 0.2),
    strip("squats_jumps", 4.2, 0.15, 1.2),
    strip("arms_trunk", 13.0, 2.1, 0.5),
    strip("sprint_stop", 4.4, 0.15, 1.4),
    strip("turn_on_spot", 0.5, 0.25, 0.3),
    strip("dance", 4.0, 0.35, 0.2),
];

/// Pictures of one strip.
const PICTURES: usize = 12;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, names @ ..] = arguments.as_slice() else {
        return Err("usage: motion_pictures FOLDER [CHARACTER.npz] [CLIP]...".into());
    };
    let (character, only) = match names {
        [file, only @ ..] if file.ends_with(".npz") => (unic_io::read_character(Path::new(file))?, only),
        only => (human(&HumanParameters::default())?, only),
    };
    println!("{:?}", Performer::new(&character)?.stature());
    let set = standard_set(&character, SEED, FPS)?;
    for clip in set.train.iter().chain(&set.test) {
        println!("{:20} {:6.1} s", clip.name, clip.seconds());
    }
    std::fs::create_dir_all(folder)?;
    for (i, strip) in STRIPS.iter().enumerate() {
        let clip = set.train.iter().chain(&set.test).find(|c| c.name == strip.clip);
        let wanted = only.is_empty() || only.iter().any(|name| name == strip.clip);
        if let (Some(clip), true) = (clip, wanted) {
            let path = PathBuf::from(folder).join(format!("{i:02}_{}.png", clip.name));
            picture_strip(&character, clip, *strip)?.save_png(&path)?;
        }
    }
    Ok(())
}

fn picture_strip(character: &Character, clip: &Clip, strip: Strip) -> Result<Image, RasterError> {
    let pictures = (0..PICTURES).map(|i| {
        let seconds = strip.start + strip.interval * i as f32;
        let x = (seconds * clip.fps).min((clip.len() - 1) as f32);
        let (frame, next) = (x as usize, (x as usize + 1).min(clip.len() - 1));
        let pose = clip.poses[frame].interpolate(&clip.poses[next], x.fract());
        let drawn = picture(character, &pose, strip.azimuth)?;
        captioned(&drawn, &format!("{seconds:.2} s"))
    });
    grid(&pictures.collect::<Result<Vec<_>, _>>()?, 6, 4)
}

fn picture(character: &Character, pose: &Pose, azimuth: f32) -> Result<Image, RasterError> {
    let (mut joints, mut transforms, mut vertices) = (Vec::new(), Vec::new(), Vec::new());
    character.skeleton.forward_kinematics(pose, &mut joints);
    character.skeleton.world_from_rest(&joints, &mut transforms);
    character
        .weights
        .skin(&character.body.vertices, &transforms, &mut vertices);
    let faces = &character.body.faces;
    let normals = vertex_normals(&vertices, faces)?;
    let body = Surface {
        vertices: &vertices,
        faces,
        normals: &normals,
        colour: Colouring::Solid([0.72, 0.66, 0.60]),
    };
    // The camera turns with the pelvis: a character that walks in circles is seen from one side.
    let forward = joints[0].vector(Vec3::Z);
    let heading = forward.x.atan2(forward.z);
    let here = joints[0].translation.with_y(0.0);
    let (min, max) = (Vec3::new(-0.65, -0.05, -0.65), Vec3::new(0.65, 2.0, 0.65));
    let camera = Camera::framing(min, max, azimuth + heading, 0.1, 0.72)?.moved_by(here);
    render(&Scene::new(&[body]), &camera, 230, 320)
}
