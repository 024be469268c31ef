//! Contract: on a real capture a trained model beats the rest shape on a clip that it has never
//! seen, and animates a finer mesh of the same garment as well as its own.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::Vec3;
use std::{path::Path, sync::Arc};
use unic_core::{
    Animator, Model, Start, StepInput,
    subdivide::{Subdivided, subdivided},
};
use unic_eval::PreparedClip;
use unic_io::{Capture, Split};
use unic_train::{Control, FieldData, Fit, Preset, TrainConfig, Trainer};

/// Model and unseen clip; none where the shared data is missing.
fn trained() -> Option<(Arc<Model>, PreparedClip)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/captures/tshirt_blender");
    if !root.exists() {
        eprintln!("skipped: no capture at {}", root.display());
        return None;
    }
    let capture = Capture::open(&root).unwrap();
    let test = capture.load_clip(&capture.clip_names(Split::Test)[0]).unwrap();
    let settings = ["optimiser.steps=30".to_owned()];
    let config = TrainConfig::preset(Preset::Tiny)
        .with_assignments(&settings)
        .unwrap();
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    let skeleton = data.capture.character.skeleton.clone();
    let test = PreparedClip::new(&data.config.motion, &skeleton, test);
    let mut trainer = Trainer::new(data, config).unwrap();
    trainer.run(None, &mut |_| Control::Continue).unwrap();
    Some((Arc::new(trainer.model().unwrap()), test))
}

/// Free-running RMSE in metres over the vertices that the clip has, from its frame 0.
fn rmse(model: &Arc<Model>, clip: &PreparedClip, start: &[Vec3]) -> f64 {
    let (motion, garment) = (&clip.captured.clip, &clip.captured.garment);
    let input = |t: usize| StepInput {
        pose: &motion.poses[t],
        next_pose: motion.poses.get(t + 1),
        ground_height: motion.ground_height,
        wind: motion.wind_at(t),
    };
    let mut animator = Animator::new(model.clone());
    animator.reset(&input(0), Start::Positions(start)).unwrap();
    let mut squares = 0.0;
    for t in 1..clip.len() {
        let predicted = animator.step(&input(t)).unwrap().positions;
        let pairs = predicted.iter().zip(garment.frame(t));
        squares += pairs.map(|(p, g)| f64::from(p.distance_squared(*g))).sum::<f64>();
    }
    (squares / ((clip.len() - 1) * garment.vertex_count()) as f64).sqrt()
}

#[test]
fn finer_mesh_of_the_garment_is_as_accurate_as_the_trained_one() {
    let Some((model, clip)) = trained() else { return };
    let first = clip.captured.garment.frame(0);
    let own = rmse(&model, &clip, first);
    let Subdivided { mesh, parents } = subdivided(&model.garment().rest);
    let middle = |p: &[u32; 2]| (first[p[0] as usize] + first[p[1] as usize]) / 2.0;
    let start: Vec<Vec3> = parents.iter().map(middle).collect();
    let finer = Arc::new(model.with_mesh(mesh).unwrap());
    let other = rmse(&finer, &clip, &start);
    println!(
        "{:.2} mm on its own mesh, {:.2} mm on the finer one",
        1e3 * own,
        1e3 * other
    );
    assert!(other <= 1.1 * own, "{other} {own}");
    // Skinning of the rest shape errs by 69 mm on this clip.
    assert!(own < 0.060, "{own}");
}
