//! Contract: metrics of frames agree with closed forms. The body is a cube, the garment a grid.

use super::*;
use crate::{ClipMetrics, Metrics, Mode, kinematics::ClipKinematics, synthetic};
use glam::Quat;
use proptest::prelude::*;

/// Frames of a grid that swings and turns far above the body.
fn swinging(garment: &Garment, frames: usize) -> Vec<Vec<Vec3>> {
    let frame = |t: usize| {
        let turn = Quat::from_rotation_y(0.1 * t as f32);
        let lift = Vec3::Y * (5.0 + (t as f32 * 0.9).sin());
        garment.rest.vertices.iter().map(|&v| turn * v + lift).collect()
    };
    (0..frames).map(frame).collect()
}

/// Metrics of predictions that are computed from the truth, frame by frame.
fn metrics_of(truth: &[Vec<Vec3>], predict: impl Fn(&[Vec3]) -> Vec<Vec3>) -> Metrics {
    let (character, garment) = (synthetic::cube(), synthetic::grid());
    let clip = synthetic::clip(&character, truth);
    let mut context = FrameContext::new(&character, &garment);
    let mut metrics = ClipMetrics::new(30.0, Mode::FreeRunning);
    let mut predicted = vec![truth[0].clone()];
    predicted.extend(truth[1..].iter().map(|frame| predict(frame)));
    for t in 1..truth.len() {
        context.prepare(&character, &clip, t, Nearest::Searched);
        let before = (t >= 3).then(|| [predicted[t - 1].as_slice(), predicted[t - 2].as_slice()]);
        let now = &predicted[t];
        metrics.add(
            t,
            &context.measure(&Prediction { now, before }, &mut context.scratch()),
        );
    }
    metrics.finish().metrics()
}

fn assert_near(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-3 * expected.abs().max(1.0),
        "{found}, not {expected}"
    );
}

#[test]
fn a_constant_offset_is_the_error() {
    let truth = swinging(&synthetic::grid(), 40);
    let offset = Vec3::new(0.02, -0.01, 0.02);
    let m = metrics_of(&truth, |frame| frame.iter().map(|&v| v + offset).collect());
    for found in [
        m.rmse_mm,
        m.mean_vertex_error_mm,
        m.mean_frame_rmse_mm,
        m.hausdorff_mm,
    ] {
        assert_near(found, 30.0);
    }
    assert_near(m.rmse_per_coordinate_mm, 30.0 / 3f64.sqrt());
    assert_near(m.rmse_mm_at_1s.unwrap(), 30.0);
    assert_near(m.jitter_ratio, 1.0);
    assert_near(m.edge_length_error_percent, 0.0);
    let inside = m.intersecting_vertices_percent_closest + m.intersecting_vertices_percent_paper;
    assert_eq!(
        (inside, m.intersecting_frames_percent, m.max_depth_mm),
        (0.0, 0.0, 0.0)
    );
}

#[test]
fn a_scaled_garment_stretches_its_edges() {
    let truth = swinging(&synthetic::grid(), 10);
    let m = metrics_of(&truth, |frame| frame.iter().map(|&v| v * 1.1).collect());
    assert_near(m.edge_length_error_percent, 10.0);
    // Its second differences are 1.1 times as large too.
    assert_near(m.jitter_ratio, 1.1);
}

#[test]
fn a_still_prediction_of_a_moving_garment_does_not_jitter() {
    let truth = swinging(&synthetic::grid(), 10);
    let first = truth[0].clone();
    assert_eq!(metrics_of(&truth, |_| first.clone()).jitter_ratio, 0.0);
}

#[test]
fn depth_is_measured_below_a_face_of_the_cube() {
    let truth = swinging(&synthetic::grid(), 6);
    let garment = synthetic::grid();
    let count = garment.rest.vertices.len();
    // One vertex 0.1 m below the top of the cube from -1 to 1, one 0.02 m, the others above it.
    let m = metrics_of(&truth, |frame| {
        let mut predicted = frame.to_vec();
        predicted[0] = Vec3::new(0.2, 0.9, 0.3);
        predicted[7] = Vec3::new(-0.5, 0.98, 0.1);
        predicted
    });
    assert_near(m.intersecting_vertices_percent_closest, 200.0 / count as f64);
    // The nearest corner's normal is diagonal, and both are behind its plane.
    assert_near(m.intersecting_vertices_percent_paper, 200.0 / count as f64);
    assert_near(m.intersecting_frames_percent, 100.0);
    assert_near(m.mean_depth_mm, 60.0);
    assert_near(m.max_depth_mm, 100.0);
}

#[test]
fn a_diverged_prediction_gives_nan_and_no_panic() {
    let truth = swinging(&synthetic::grid(), 6);
    for bad in [f32::NAN, f32::INFINITY] {
        let m = metrics_of(&truth, |frame| {
            let mut predicted = frame.to_vec();
            predicted[3].y = bad;
            predicted
        });
        assert!(!m.rmse_mm.is_finite() && !m.hausdorff_mm.is_finite(), "{m:?}");
    }
    let m = metrics_of(&truth, |frame| frame.iter().map(|v| v * 1e30).collect());
    assert!(m.rmse_mm > 1e30 && m.rmse_mm.is_finite());
}

#[test]
fn frame_0_has_the_velocity_of_frame_1() {
    let character = synthetic::cube();
    let clip = synthetic::clip(&character, &swinging(&synthetic::grid(), 5));
    let c = |t| clip.kinematics.motion(t)[3..6].to_vec();
    assert_eq!((clip.kinematics.len(), c(0)), (5, c(1)));
    assert!(c(1)[2] > 0.1, "walks forwards: {:?}", c(1));
    let again = ClipKinematics::new(&synthetic::spec(), &character.skeleton, &clip.captured.clip);
    assert_eq!(again, clip.kinematics);
}

fn cloud() -> impl Strategy<Value = Vec<Vec3>> {
    let point = prop::array::uniform3(-1.0_f32..1.0).prop_map(Vec3::from);
    prop::collection::vec(point, 40)
}

proptest! {
    #[test]
    fn hausdorff_agrees_with_its_definition(a in cloud(), b in cloud(), near in any::<bool>()) {
        // Predictions near the truth, which are usual, and predictions anywhere.
        let b: Vec<Vec3> = a.iter().zip(b).map(|(&a, b)| if near { a + b * 0.05 } else { b }).collect();
        let nearest = |p: &Vec3, set: &[Vec3]| {
            set.iter().map(|q| p.distance(*q)).fold(f32::INFINITY, f32::min)
        };
        let one_way = |from: &[Vec3], to: &[Vec3]| {
            from.iter().map(|p| nearest(p, to)).fold(0.0, f32::max)
        };
        let (tree_a, tree_b) = (ClosestVertex::build(&a), ClosestVertex::build(&b));
        let found = farthest(&b, &a, &tree_a, farthest(&a, &b, &tree_b, 0.0));
        prop_assert!((found - one_way(&a, &b).max(one_way(&b, &a))).abs() < 1e-6);
    }
}
