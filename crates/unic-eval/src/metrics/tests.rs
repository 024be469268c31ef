//! Contract: metrics follow from sums as their definitions say, and pool by sums; the JSON keys and
//! their order are fixed.

use super::*;

/// Sums of ten vertices, each `error` metres off.
fn off_by(error: f64) -> FrameSums {
    FrameSums {
        vertices: 10,
        squared: 10.0 * error * error,
        distance: 10.0 * error,
        probed: 10,
        ..FrameSums::default()
    }
}

/// Sums of the frames 0..count at `fps`. The error in millimetres is the number of the second
/// that the frame belongs to.
fn drifting(fps: f32, count: usize) -> PooledMetrics {
    let mut clip = ClipMetrics::new(fps, Mode::FreeRunning);
    for t in 0..count {
        let second = (t as f64 / f64::from(fps) - 1e-9).ceil();
        clip.add(t, &off_by(if t == 0 { 99.0 } else { second * 1e-3 }));
    }
    clip.finish()
}

fn close(a: Option<f64>, b: f64) -> bool {
    a.is_some_and(|a| (a - b).abs() < 1e-9)
}

#[test]
fn seconds_count_only_when_they_are_complete() {
    for fps in [24.0, 30.0, 60.0] {
        let frames = 10 * fps as usize + 1;
        let m = drifting(fps, frames).metrics();
        assert!(
            close(m.rmse_mm_at_1s, 1.0) && close(m.rmse_mm_at_5s, 5.0),
            "{m:?}"
        );
        assert!(close(m.rmse_mm_at_10s, 10.0));
        assert_eq!(m.rmse_mm_at_60s, None);
        assert_eq!(m.drift_mm.len(), 10);
        assert_eq!(drifting(fps, frames - 1).metrics().rmse_mm_at_10s, None);
        assert_eq!(drifting(fps, frames - 1).metrics().drift_mm.len(), 10);
    }
    // At 29.97 frames per second no frame lies on a whole second.
    assert!(close(drifting(29.97, 151).metrics().rmse_mm_at_5s, 5.0));
}

#[test]
fn one_step_evaluation_has_no_drift() {
    let mut clip = ClipMetrics::new(30.0, Mode::OneStep);
    (1..100).for_each(|t| clip.add(t, &off_by(1e-3)));
    let m = clip.finish().metrics();
    assert_eq!((m.rmse_mm_at_1s, m.drift_mm.len()), (None, 0));
    assert!((m.rmse_mm - 1.0).abs() < 1e-9);
}

#[test]
fn clips_are_pooled_by_sums() {
    let clip = |frames: usize, error: f64| {
        let mut clip = ClipMetrics::new(10.0, Mode::FreeRunning);
        (0..=frames).for_each(|t| clip.add(t, &off_by(error)));
        clip.finish()
    };
    let (long, short) = (clip(60, 1e-3), clip(20, 3e-3));
    let mut all = long.clone();
    all.pool(&short);
    let m = all.metrics();
    assert!((m.rmse_mm - ((60.0 + 20.0 * 9.0) / 80.0_f64).sqrt()).abs() < 1e-9);
    assert!((m.mean_vertex_error_mm - (60.0 + 20.0 * 3.0) / 80.0).abs() < 1e-9);
    assert!((m.mean_frame_rmse_mm - 1.5).abs() < 1e-9);
    // Only the long clip has a fifth second.
    assert!(close(m.rmse_mm_at_5s, 1.0) && close(m.rmse_mm_at_1s, 5.0_f64.sqrt()));
    let mut other = short;
    other.pool(&long);
    assert_eq!(other.frames(), 80);
    assert!((other.metrics().rmse_mm - m.rmse_mm).abs() < 1e-12);
}

#[test]
fn frames_without_a_nearest_search_count_only_for_errors() {
    let mut clip = ClipMetrics::new(30.0, Mode::OneStep);
    let probed = FrameSums {
        inside_closest: 5,
        hausdorff: 0.004,
        ..off_by(1e-3)
    };
    clip.add(1, &probed);
    clip.add(
        2,
        &FrameSums {
            probed: 0,
            ..off_by(1e-3)
        },
    );
    let m = clip.finish().metrics();
    assert_eq!(
        (
            m.intersecting_vertices_percent_closest,
            m.intersecting_frames_percent
        ),
        (50.0, 100.0)
    );
    assert!((m.hausdorff_mm - 4.0).abs() < 1e-9 && (m.rmse_mm - 1.0).abs() < 1e-9);
}

#[test]
fn json_keys_and_order_are_a_contract() {
    let mut clip = ClipMetrics::new(30.0, Mode::FreeRunning);
    clip.add(1, &off_by(f64::NAN));
    let text = serde_json::to_string(&clip.finish().metrics()).unwrap();
    let key = |part: &str| part.rsplit('"').next().map(str::to_owned);
    let keys: Vec<_> = text.split("\":").filter_map(key).collect();
    let expected = "rmse_mm rmse_per_coordinate_mm mean_vertex_error_mm mean_frame_rmse_mm \
        hausdorff_mm intersecting_vertices_percent_paper intersecting_vertices_percent_closest \
        intersecting_frames_percent mean_depth_mm max_depth_mm jitter_ratio \
        edge_length_error_percent rmse_mm_at_1s rmse_mm_at_5s rmse_mm_at_10s rmse_mm_at_60s \
        drift_mm";
    assert_eq!(keys[..keys.len() - 1].join(" "), expected);
    assert!(text.contains("\"rmse_mm\":null") && text.contains("\"drift_mm\":[null]"));
    let back: Metrics = serde_json::from_str(&text).unwrap();
    assert!(back.rmse_mm.is_nan() && back.drift_mm[0].is_nan());
    assert_eq!(back.hausdorff_mm, 0.0);
    // Files without measures of life stay readable, and unknown keys are errors.
    assert!(back.bands.is_empty() && back.popping_ratio.is_none());
    let unknown = text.replace("drift_mm", "drift_cm");
    assert!(serde_json::from_str::<Metrics>(&unknown).is_err());
}

#[test]
fn json_keys_and_order_of_the_measures_of_life_are_a_contract() {
    let band = BandMetrics {
        from_cm: 24,
        to_cm: None,
        amplitude_ratio: 0.5,
        living_ratio: f64::NAN,
        correlation: Some(0.25),
        autocorrelation_1s: None,
        autocorrelation_1s_truth: Some(0.75),
    };
    let metrics = Metrics {
        bands: vec![band],
        strain_p01_percent: Some(-1.5),
        strain_p99_percent: Some(2.5),
        strain_p01_percent_truth: Some(-0.5),
        strain_p99_percent_truth: Some(1.25),
        bending_ratio: Some(0.875),
        popping_ratio: Some(f64::NAN),
        self_crossing_edges_percent: Some(3.5),
        self_crossing_edges_percent_truth: Some(0.0),
        ..Metrics::default()
    };
    let text = serde_json::to_string(&metrics).unwrap();
    let expected = "\"drift_mm\":[],\"bands\":[{\"from_cm\":24,\"to_cm\":null,\
        \"amplitude_ratio\":0.5,\"living_ratio\":null,\"correlation\":0.25,\
        \"autocorrelation_1s\":null,\"autocorrelation_1s_truth\":0.75}],\
        \"strain_p01_percent\":-1.5,\"strain_p99_percent\":2.5,\
        \"strain_p01_percent_truth\":-0.5,\"strain_p99_percent_truth\":1.25,\
        \"bending_ratio\":0.875,\"popping_ratio\":null,\
        \"self_crossing_edges_percent\":3.5,\"self_crossing_edges_percent_truth\":0.0}";
    assert!(text.ends_with(expected), "{text}");
    let back: Metrics = serde_json::from_str(&text).unwrap();
    assert!(back.bands[0].living_ratio.is_nan());
    assert!(back.popping_ratio.is_some_and(f64::is_nan));
}
