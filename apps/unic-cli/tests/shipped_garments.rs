//! Contract: the garments that come with the program are small, fit the built-in human, tell where
//! they come from, and stay on the body of a steered character.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::Vec3;
use std::sync::Arc;
use unic_builtin::{
    human::{HumanParameters, human},
    motion::control_set,
};
use unic_cli::garments::Shipped;
use unic_core::{Animator, Start, StepInput};

/// Largest model file, bytes.
// 4 MB of it are wrinkles to replay.
const MOST_BYTES: usize = 12_000_000;
/// Frames of the run.
const FRAMES: usize = 100;
/// Largest distance of a vertex from the root joint, metres: the hem of a skirt in a turn.
const FARTHEST_M: f32 = 1.2;

#[test]
fn models_are_small_and_of_the_built_in_human() {
    let human = human(&HumanParameters::default()).unwrap();
    for garment in Shipped::ALL {
        assert!(garment.bytes().len() <= MOST_BYTES, "{}", garment.name());
        let model = garment.model().unwrap();
        assert_eq!(model.character().skeleton, human.skeleton);
        assert_eq!(model.character().body.vertices.len(), human.body.vertices.len());
        assert_eq!(model.config().fps, 30.0);
    }
}

#[test]
fn models_tell_how_they_were_made() {
    for garment in Shipped::ALL {
        let model = garment.model().unwrap();
        let about = model.about();
        assert_eq!(about.name, garment.name());
        let made = format!("garment {} on character human, simulated by unic", garment.name());
        assert!(about.provenance.starts_with(&made), "{}", about.provenance);
        assert_eq!(about.training["settings"]["seed"], 1);
        assert!(about.training["program"].as_str().unwrap().starts_with("unic "));
        let clips = about.training["training_clips"].as_array().unwrap();
        assert!(clips.iter().any(|clip| clip == "random_mouse_1"));
        assert!(!clips.iter().any(|clip| clip == "random_mouse_12"), "a test clip");
    }
}

#[test]
fn garments_stay_finite_and_near_the_body() {
    for garment in Shipped::ALL {
        let model = Arc::new(garment.model().unwrap());
        let clips = control_set(model.character(), 1, model.config().fps).unwrap();
        let clip = clips.iter().find(|clip| clip.name == "control_turns").unwrap();
        let mut animator = Animator::new(model);
        for t in 0..FRAMES {
            let input = StepInput::of_clip(clip, t);
            let frame = match t {
                0 => animator.reset(&input, Start::MeanShape),
                _ => animator.step(&input),
            };
            let root = clip.poses[t].trans + Vec3::Y;
            let positions = frame.unwrap().positions;
            // Written so that NaN fails.
            let is_near = |p: &Vec3| p.distance(root) < FARTHEST_M;
            assert!(positions.iter().all(is_near), "{}, frame {t}", garment.name());
        }
    }
}
