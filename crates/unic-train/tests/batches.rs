//! Contract: a batch is a function of seed and step, a mirrored window is a window of the mirrored
//! clip, and a window that starts at frame 0 starts as the animator does.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::Vec3;
use unic_io::Split;
use unic_train::*;

fn assert_close(what: &str, a: &[f32], b: &[f32]) {
    assert!(
        !a.is_empty() && a.len() == b.len(),
        "{what}: {} and {}",
        a.len(),
        b.len()
    );
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() < 2e-4, "{what} {i}: {a} {b}");
    }
}

fn everything(batch: &Batch) -> (Vec<Window>, Vec<f32>) {
    let arrays = [vec![
        batch.motion.clone(),
        batch.start.clone(),
        batch.before_start.clone(),
    ]];
    let arrays = arrays
        .into_iter()
        .chain([batch.frame_inputs.clone(), batch.targets.clone()]);
    (batch.windows.clone(), arrays.flatten().flatten().collect())
}

#[test]
fn a_batch_depends_on_seed_and_step_alone() {
    for preset in PRESETS {
        let mut config = small(preset);
        config.regularisation.state_noise_m = 0.01;
        let (data, again) = (dataset(&config), dataset(&config));
        let batch =
            |data: &FieldData, config: &TrainConfig, step| everything(&Batch::gather(data, config, step));
        let first = batch(&data, &config, 7);
        assert_eq!(first, batch(&again, &config, 7));
        assert_ne!(first, batch(&data, &config, 8));
        config.seed += 1;
        assert_ne!(first, batch(&data, &config, 7));
    }
}

#[test]
fn windows_stay_inside_their_clips_and_their_vertices_are_distinct() {
    let config = small(Preset::Tiny);
    let data = dataset(&config);
    let (mut starts, mut ends) = (0, 0);
    for step in 0..200 {
        let batch = Batch::gather(&data, &config, step);
        assert_eq!(batch.frames, config.unroll(step));
        for window in &batch.windows {
            let mut points = window.points.clone();
            points.sort_unstable();
            points.dedup();
            assert_eq!(points.len(), config.batch.points);
            assert!(points.iter().all(|p| (*p as usize) < VERTICES));
            let last = window.start + batch.frames;
            assert!(last < FRAMES);
            starts += usize::from(window.start == 0);
            ends += usize::from(last == FRAMES - 1);
        }
    }
    assert!(
        starts > 0 && ends > 0,
        "the first and the last frames are never drawn"
    );
}

/// A training set that is its own mirror image: two takes and the mirror image of each.
fn symmetric(config: &TrainConfig) -> FieldData {
    let takes = [0, 1].map(|seed| take(&format!("take{seed}"), seed, FRAMES));
    let images = [0, 1].map(|i| mirror_image(&takes[i], &format!("image{i}")));
    let mut all: Vec<_> = takes
        .into_iter()
        .chain(images)
        .map(|t| (t, Split::Train))
        .collect();
    all.push((take("validation", 5, FRAMES), Split::Validation));
    dataset_of(&all, config)
}

#[test]
fn a_mirrored_window_is_a_window_of_the_mirrored_clip() {
    for preset in PRESETS {
        let mut config = without_noise(small(preset));
        config.regularisation.mirror = true;
        let data = symmetric(&config);
        assert!(data.mirrors());
        let points: Vec<u32> = (0..VERTICES as u32).collect();
        let opposites = points.iter().map(|p| opposite(*p)).collect();
        for start in [0, 1, 9] {
            let window = |clip, view, points: &Vec<u32>| Window {
                clip,
                start,
                view,
                points: points.clone(),
            };
            let mirrored = Batch::of_windows(&data, vec![window(1, View::Mirrored, &points)], 4);
            let image = Batch::of_windows(&data, vec![window(3, View::Direct, &opposites)], 4);
            let plain = Batch::of_windows(&data, vec![window(1, View::Direct, &points)], 4);
            assert_close("motion", &mirrored.motion, &image.motion);
            assert_close("start", &mirrored.start, &image.start);
            assert_close(
                "state before the start",
                &mirrored.before_start,
                &image.before_start,
            );
            for k in 0..4 {
                assert_close("target", &mirrored.targets[k], &image.targets[k]);
                if preset != Preset::Paper {
                    assert_close("inputs", &mirrored.frame_inputs[k], &image.frame_inputs[k]);
                }
            }
            assert_ne!(mirrored.motion, plain.motion);
            assert_ne!(mirrored.start, plain.start);
        }
    }
}

/// Poses and garment of a take carried through the world, 3 m a second.
fn carried_away(take: &Take) -> Take {
    let mut carried = take.clone();
    for (t, (pose, garment)) in carried
        .clip
        .poses
        .iter_mut()
        .zip(&mut carried.garment)
        .enumerate()
    {
        let by = Vec3::new(0.1, 0.02, -0.05) * t as f32;
        pose.trans += by;
        garment.iter_mut().for_each(|v| *v += by);
    }
    carried
}

#[test]
fn states_and_targets_do_not_depend_on_the_distance_travelled() {
    use unic_core::motion::MotionLayout::{Heading, Paper, PaperRootRelative};
    for layout in [Paper, PaperRootRelative, Heading] {
        let mut config = without_noise(small(Preset::Paper));
        config.model.layout = layout;
        let batch = |carry: fn(&Take) -> Take| {
            let takes: Vec<_> = (takes().iter())
                .map(|(take, split)| (carry(take), *split))
                .collect();
            let data = dataset_of(&takes, &config);
            let window = Window {
                clip: 1,
                start: 6,
                view: View::Direct,
                points: (0..VERTICES as u32).collect(),
            };
            let travelled = data.clips[1].captured.garment.frame(16)[0];
            (Batch::of_windows(&data, vec![window], 10), travelled)
        };
        let ((here, near), (there, far)) = (batch(Take::clone), batch(carried_away));
        assert!(near.distance(far) > 1.0);
        let close = |a: &[f32], b: &[f32]| {
            assert!(!a.is_empty() && a.len() == b.len());
            a.iter()
                .zip(b)
                .for_each(|(a, b)| assert!((a - b).abs() < 1e-5, "{layout:?}: {a} {b}"));
        };
        close(&here.before_start, &there.before_start);
        close(&here.start, &there.start);
        for (here, there) in here.targets.iter().zip(&there.targets) {
            close(here, there);
        }
    }
}

#[test]
fn mirroring_twice_changes_nothing() {
    let data = dataset(&small(Preset::Tiny));
    let map = MirrorMap::new(&data.config.motion.springs, &data.capture.character.skeleton).unwrap();
    let vector = numbers(data.normalisation.mean.len(), 1.0, 1);
    assert_ne!(map.apply(&vector), vector);
    assert_eq!(map.apply(&map.apply(&vector)), vector);
}

#[test]
fn a_window_from_frame_0_starts_at_rest() {
    for preset in PRESETS {
        let data = dataset(&small(preset));
        let at = |start| {
            let window = Window {
                clip: 0,
                start,
                view: View::Direct,
                points: vec![0, 7, 31],
            };
            Batch::of_windows(&data, vec![window], 2)
        };
        assert_eq!(at(0).start, at(0).before_start);
        assert_ne!(at(1).start, at(1).before_start);
        assert_eq!(at(0).targets[0], at(1).start);
        assert_eq!(at(0).start, at(1).before_start);
    }
}
