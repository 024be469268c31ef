//! Scene: a body and a garment in motion.

use super::refine::Refined;
use glam::Vec3;
use std::path::Path;
use unic_builtin::scale::{NetworkSize, random_model, walk};
use unic_core::{
    Pose,
    character::{Character, Garment},
    transform::Rigid,
};
use unic_io::Capture;

const BODY_VERTICES: usize = 6_890;
const FRAMES: usize = 60;

pub(crate) struct Scene {
    pub(crate) name: &'static str,
    pub(crate) character: Character,
    pub(crate) garment: Garment,
    pub(crate) frames: Vec<Frame>,
}

/// Posed body and garment of one frame, world space, metres.
pub(crate) struct Frame {
    pub(crate) world_from_rest: Vec<Rigid>,
    pub(crate) body: Vec<Vec3>,
    pub(crate) garment: Vec<Vec3>,
}

impl Scene {
    /// Loads a captured T-shirt on a real body that runs, or makes tubes if there are no data.
    pub(crate) fn new(garment_vertices: usize) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/captures/tshirt_blender");
        match Capture::open(&root) {
            Ok(capture) => Self::captured(&capture, garment_vertices),
            Err(error) => {
                eprintln!("skipped: the captured scene ({error})");
                Self::synthetic(garment_vertices)
            }
        }
    }

    fn captured(capture: &Capture, garment_vertices: usize) -> Self {
        let clips = capture.clips_on_disk().expect("clips");
        let name = clips
            .iter()
            .find(|name| name.contains("run"))
            .unwrap_or(&clips[0]);
        let clip = capture.load_clip(name).expect("a sound clip");
        let body = Refined::new(&capture.character.body, BODY_VERTICES);
        let cloth = Refined::new(&capture.garment.rest, garment_vertices);
        let character = Character {
            weights: body.weights(&capture.character.weights),
            body: body.mesh,
            skeleton: capture.character.skeleton.clone(),
            file_mesh: None,
        };
        let positions = |t: usize| cloth.positions(clip.garment.frame(t));
        let count = FRAMES.min(clip.clip.len());
        Self {
            name: "captured T-shirt",
            frames: (0..count)
                .map(|t| frame(&character, &clip.clip.poses[t], positions(t)))
                .collect(),
            character,
            garment: {
                let weights = cloth.weights(&capture.garment.weights);
                Garment::new(cloth.mesh, weights)
            },
        }
    }

    /// Makes a tube around a tube at a distance of 1 cm, both skinned.
    fn synthetic(garment_vertices: usize) -> Self {
        let model = random_model(NetworkSize::Standard, garment_vertices).expect("a garment of that size");
        let parts = model.to_parts();
        let (character, garment) = (parts.character, parts.garment);
        let skinned = |t: usize| {
            let mut frame = frame(&character, &walk(t), Vec::new());
            let weights = &garment.weights;
            weights.skin(&garment.rest.vertices, &frame.world_from_rest, &mut frame.garment);
            frame
        };
        Self {
            name: "tubes",
            frames: (0..FRAMES).map(skinned).collect(),
            character,
            garment,
        }
    }
}

fn frame(character: &Character, pose: &Pose, garment: Vec<Vec3>) -> Frame {
    let (mut world_from_joint, mut world_from_rest, mut body) = (Vec::new(), Vec::new(), Vec::new());
    let skeleton = &character.skeleton;
    skeleton.forward_kinematics(pose, &mut world_from_joint);
    skeleton.world_from_rest(&world_from_joint, &mut world_from_rest);
    character
        .weights
        .skin(&character.body.vertices, &world_from_rest, &mut body);
    Frame {
        world_from_rest,
        body,
        garment,
    }
}
