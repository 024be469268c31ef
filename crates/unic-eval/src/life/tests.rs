//! Contract: measures of life agree with closed forms on a cylinder that wrinkles along its axis;
//! they do not change under rigid motion; the judge tells garments apart by their wrinkles.

use super::{
    band_filter::{BANDS, BandFilter, WAVELENGTHS_CM},
    judge::{ClipWindows, judge},
    welded::WeldedMesh,
    *,
};
use crate::{MODEL, Metrics, PooledMetrics, baselines::RIDGE, synthetic};
use glam::Quat;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use std::f32::consts::TAU;
use unic_core::{Pose, clip::Clip, mesh::TriMesh, skinning::SkinningWeights};
use unic_io::{CapturedClip, frames::GarmentFrames};

const FPS: f32 = 30.0;
/// Radius of the cylinder, metres.
const RADIUS: f32 = 0.1;
/// Number of faces around the cylinder.
const SECTORS: usize = 20;

/// Cylinder with a wave along its axis.
struct Cylinder {
    garment: Garment,
    /// Wavelength, metres.
    wavelength: f32,
}

impl Cylinder {
    /// Cylinder with `rings` rings of vertices, which follows the root joint. Lengths in metres.
    fn new(wavelength: f32, length: f32, rings: usize) -> Self {
        let vertex = |i: usize| {
            let angle = (i % SECTORS) as f32 / SECTORS as f32 * TAU;
            let height = (i / SECTORS) as f32 / (rings - 1) as f32 * length;
            Vec3::new(RADIUS * angle.cos(), height, -RADIUS * angle.sin())
        };
        let square = |i: usize| {
            let (a, b) = (i, i / SECTORS * SECTORS + (i + 1) % SECTORS);
            let [a, b, c, d] = [a, b, a + SECTORS, b + SECTORS].map(|v| v as u32);
            [[a, b, d], [a, d, c]]
        };
        let count = rings * SECTORS;
        let rest = TriMesh::new(
            (0..count).map(vertex).collect(),
            (0..count - SECTORS).flat_map(square).collect(),
        );
        let weights = SkinningWeights::from_dense(&[1.0, 0.0].repeat(count), count, 2);
        Self {
            garment: Garment::new(rest.unwrap(), weights.unwrap()),
            wavelength,
        }
    }

    /// Shape with a radial wave of this amplitude, metres.
    fn waved(&self, amplitude: f32) -> Vec<Vec3> {
        let wave = |v: &Vec3| {
            let radial = Vec3::new(v.x, 0.0, v.z) / RADIUS;
            *v + radial * amplitude * (TAU * v.y / self.wavelength).cos()
        };
        self.garment.rest.vertices.iter().map(wave).collect()
    }

    /// Shapes of `frames` frames with the amplitudes of a function of the frame, metres.
    fn shapes(&self, frames: usize, amplitude: impl Fn(usize) -> f32) -> Vec<Vec<Vec3>> {
        (0..frames).map(|t| self.waved(amplitude(t))).collect()
    }

    /// Measures predicted shapes against true ones, both relative to a root with these poses.
    fn life(&self, truth: &[Vec<Vec3>], predicted: &[Vec<Vec3>], pose: impl Fn(usize) -> Pose) -> Lives {
        let poses: Vec<Pose> = (0..truth.len()).map(pose).collect();
        let placed = |shapes: &[Vec<Vec3>]| -> Vec<Vec<Vec3>> {
            let place = |(shape, pose): (&Vec<Vec3>, &Pose)| {
                shape.iter().map(|&v| pose.local[0] * v + pose.trans).collect()
            };
            shapes.iter().zip(&poses).map(place).collect()
        };
        let [truth, predicted] = [truth, predicted].map(placed);
        let clip = prepared(poses.clone(), &truth);
        let measure = LifeMeasure::new(&self.garment).unwrap();
        let mut life = measure.start(FPS, 1);
        // Chunks of uneven length, each with the two predictions before it.
        for (first, last) in [(1, 33), (33, 40), (40, truth.len())] {
            let last = last.min(truth.len());
            if first < last {
                let window: Vec<_> = (first..last + 2)
                    .map(|t| predicted[t.max(2) - 2].clone())
                    .collect();
                measure.add(&mut life, &clip, &[&window], &(first..last));
            }
        }
        let mut windows = ClipWindows {
            truth: Vec::new(),
            predicted: Vec::new(),
        };
        let mut lives = measure.finish(life, &mut windows.truth);
        let PredictorLife { sums, windows: own } = lives.remove(0);
        windows.predicted.push(own);
        Lives { sums, windows }
    }
}

/// Results of one prediction on one clip.
struct Lives {
    sums: LifeSums,
    windows: ClipWindows,
}

impl Lives {
    fn metrics(&self) -> Metrics {
        let mut sums = PooledMetrics::default();
        sums.set_life(self.sums.clone());
        sums.metrics()
    }
}

fn prepared(poses: Vec<Pose>, garment: &[Vec<Vec3>]) -> PreparedClip {
    let numbers: Vec<f32> = garment.iter().flatten().flat_map(|v| v.to_array()).collect();
    let captured = CapturedClip {
        findings: Vec::new(),
        clip: Clip {
            name: "wave".into(),
            fps: FPS,
            poses,
            ground_height: -1.0,
            wind: Vec::new(),
        },
        garment: GarmentFrames::new(numbers, garment.len(), garment[0].len()).unwrap(),
        body: None,
    };
    PreparedClip::new(&synthetic::spec(), &synthetic::cube().skeleton, captured)
}

/// Pose of a character that stands.
fn standing(_: usize) -> Pose {
    placed(Quat::IDENTITY, Vec3::ZERO)
}

fn placed(turn: Quat, trans: Vec3) -> Pose {
    Pose {
        trans,
        local: vec![turn, Quat::IDENTITY],
    }
}

/// Sine over time with this period in seconds.
fn swing(period: f32) -> impl Fn(usize) -> f32 {
    move |t| (TAU * t as f32 / FPS / period).sin()
}

/// Pseudo-random numbers in [−1, 1], one for each measured frame and the two before it.
fn noise(seed: u64) -> impl Fn(usize) -> f32 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let numbers: Vec<f32> = (0..1000).map(|_| random.random_range(-1.0..1.0)).collect();
    move |t| numbers[t.div_ceil(3)]
}

fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() < tolerance, "{found}, not {expected}");
}

/// Response of a smoothing to the wave on the cylinder. A radial wave bends with the cylinder, too,
/// which adds 1 / R² to the eigenvalue of the Laplacian.
fn response(smoothing: Option<usize>, wavelength: f32) -> f64 {
    let Some(&cm) = smoothing.and_then(|k| WAVELENGTHS_CM.get(k)) else {
        return 1.0;
    };
    let tau = (f64::from(cm) / 100.0 / f64::from(TAU)).powi(2);
    let eigenvalue = f64::from(TAU / wavelength).powi(2) + f64::from(RADIUS).powi(-2);
    1.0 / (1.0 + tau * eigenvalue)
}

#[test]
fn wrinkles_of_a_wave_are_what_its_smoothing_removes() {
    let (wavelength, amplitude, margin) = (0.1, 1e-3, 0.3);
    let length = 2.0 * margin + 3.0 * wavelength;
    let cylinder = Cylinder::new(wavelength, length, 181);
    let rest = &cylinder.garment.rest.vertices;
    let displacements = |a: f32| -> Vec<Vec3> {
        let waved = cylinder.waved(a);
        waved.iter().zip(rest).map(|(x, r)| *x - *r).collect()
    };
    let fields = [amplitude, -2.0 * amplitude].map(displacements);
    let filter = WrinkleFilter::new(&cylinder.garment, 0.24).unwrap();
    let wrinkles = filter.wrinkles(&fields);
    let heights: Vec<f32> = filter.heights(&fields[0]).collect();
    // A height is a number, which does not bend with the cylinder.
    let expected = 1.0 - 1.0 / (1.0 + (0.24 / wavelength).powi(2));
    for v in (0..rest.len()).filter(|&v| (margin..length - margin).contains(&rest[v].y)) {
        let error = |found: f32, factor: f32| (found - factor * expected * heights[v]).abs();
        assert!(error(wrinkles[v], 1.0) < 0.03 * amplitude, "{v}: {}", wrinkles[v]);
        assert!(error(wrinkles[rest.len() + v], -2.0) < 0.06 * amplitude);
    }
    assert!(heights.iter().any(|h| *h > 0.9 * amplitude));
}

#[test]
fn a_pleated_garment_that_shifts_has_no_wrinkles() {
    let (length, margin, shift) = (0.6, 0.15, 1e-3);
    let mut cylinder = Cylinder::new(0.04, length, 241);
    // Pleats of 4 cm, whose own normals lean up and down.
    cylinder.garment.rest.vertices = cylinder.waved(0.015);
    let filter = WrinkleFilter::new(&cylinder.garment, 0.24).unwrap();
    let rest = &cylinder.garment.rest.vertices;
    let wrinkles = filter.wrinkles(&[vec![Vec3::Y * shift; rest.len()]]);
    for (v, wrinkle) in wrinkles.iter().enumerate() {
        if (margin..length - margin).contains(&rest[v].y) {
            assert!(wrinkle.abs() < 0.1 * shift, "{v}: {wrinkle}");
        }
    }
}

#[test]
fn a_vertex_that_the_mask_fixes_has_no_wrinkles() {
    let mut cylinder = Cylinder::new(0.1, 0.5, 51);
    let rest = cylinder.garment.rest.vertices.clone();
    let count = rest.len();
    let share = |v: usize| [0.0, 0.5, 1.0][v % 3];
    let waved = cylinder.waved(1e-3);
    let field: Vec<Vec3> = (0..count).map(|v| (waved[v] - rest[v]) * share(v)).collect();
    let whole = WrinkleFilter::new(&cylinder.garment, 0.24).unwrap();
    cylinder.garment.mask = Some((0..count).map(share).collect());
    let masked = WrinkleFilter::new(&cylinder.garment, 0.24).unwrap();
    let [whole, masked] = [whole, masked].map(|filter| filter.wrinkles(std::slice::from_ref(&field)));
    let heights = |v: usize| field[v].dot(Vec3::new(rest[v].x, 0.0, rest[v].z).normalize());
    for v in 0..count {
        // The height counts whole, and its smoothing by the share.
        let expected = heights(v) - share(v) * (heights(v) - whole[v]);
        assert!(
            (masked[v] - expected).abs() < 2e-5,
            "{v}: {} not {expected}",
            masked[v]
        );
    }
    assert!(masked.iter().step_by(3).all(|w| *w == 0.0));
}

#[test]
fn bands_of_a_wave_have_the_responses_of_the_smoothings() {
    for wavelength in [0.025_f32, 0.045, 0.09, 0.17, 0.5] {
        // Smoothings pull both ends inwards, which is felt along 24 cm / 2π, and the wave tilts the
        // normals there. Between the margins are whole waves, far from the ends.
        let margin = 0.2;
        let length = 2.0 * margin + (0.1 / wavelength).ceil() * wavelength;
        let rings = (length / (wavelength / 16.0).min(0.01)).ceil() as usize + 1;
        let cylinder = Cylinder::new(wavelength, length, rings);
        let rest = &cylinder.garment.rest;
        let filter = BandFilter::new(WeldedMesh::new(rest)).unwrap();
        let skinned = filter.coarsest(&rest.vertices);
        let amplitude = wavelength / 200.0;
        let [flat, waved] = [0.0, amplitude].map(|a| filter.signals(&cylinder.waved(a), &skinned));
        let count = rest.vertices.len();
        assert_eq!(waved.len(), BANDS * count, "all vertices are measured");
        let inside = |v: &usize| (margin..length - margin).contains(&rest.vertices[*v].y);
        let inside: Vec<usize> = (0..count).filter(inside).collect();
        for band in 0..BANDS {
            let square = |&v: &usize| f64::from(waved[band * count + v] - flat[band * count + v]).powi(2);
            let found = (2.0 * inside.iter().map(square).sum::<f64>() / inside.len() as f64).sqrt();
            let coarser = if band + 1 < BANDS {
                response(Some(band), wavelength)
            } else {
                0.0
            };
            let expected = response(band.checked_sub(1), wavelength) - coarser;
            assert_near(found / f64::from(amplitude), expected, 0.02);
        }
    }
}

#[test]
fn a_swing_has_the_ratio_of_its_amplitudes_and_a_known_autocorrelation() {
    let cylinder = Cylinder::new(0.12, 0.24, 25);
    let shapes = |amplitude: f32| {
        let swing = swing(1.25);
        cylinder.shapes(451, move |t| amplitude * swing(t))
    };
    let (truth, predicted) = (shapes(2e-3), shapes(1e-3));
    let metrics = cylinder.life(&truth, &predicted, standing).metrics();
    assert_eq!(metrics.bands.len(), BANDS);
    for band in &metrics.bands {
        assert_near(band.living_ratio, 0.5, 5e-3);
        assert_near(band.correlation.unwrap(), 1.0, 1e-3);
        let expected = (std::f64::consts::TAU / 1.25).cos();
        assert_near(band.autocorrelation_1s.unwrap(), expected, 0.02);
        assert_near(band.autocorrelation_1s_truth.unwrap(), expected, 0.02);
    }
    let [finest, coarsest] = [&metrics.bands[0], &metrics.bands[BANDS - 1]];
    assert_eq!((finest.from_cm, finest.to_cm), (0, Some(3)));
    assert_eq!((coarsest.from_cm, coarsest.to_cm), (24, None));
    assert_near(metrics.popping_ratio.unwrap(), 0.5, 0.02);
    assert_near(metrics.bending_ratio.unwrap(), 0.5, 0.02);
}

#[test]
fn equal_clips_have_ratios_of_one() {
    let cylinder = Cylinder::new(0.12, 0.24, 25);
    let truth = cylinder.shapes(100, |t| 2e-3 * swing(0.7)(t));
    let metrics = cylinder.life(&truth, &truth, standing).metrics();
    for band in &metrics.bands {
        let ratios = [band.amplitude_ratio, band.living_ratio, band.correlation.unwrap()];
        assert!(
            ratios.iter().all(|ratio| (ratio - 1.0).abs() < 1e-9),
            "{ratios:?}"
        );
        assert_eq!(band.autocorrelation_1s, band.autocorrelation_1s_truth);
    }
    let ratios = (metrics.bending_ratio, metrics.popping_ratio);
    assert_eq!(ratios, (Some(1.0), Some(1.0)));
    assert_eq!(metrics.strain_p01_percent, metrics.strain_p01_percent_truth);
    let crossings = [
        metrics.self_crossing_edges_percent,
        metrics.self_crossing_edges_percent_truth,
    ];
    assert_eq!(crossings, [Some(0.0); 2]);
}

#[test]
fn self_crossings_are_those_of_the_prediction_in_every_third_measured_frame() {
    let cylinder = Cylinder::new(0.12, 0.24, 13);
    let truth = cylinder.shapes(100, |_| 0.0);
    // In some frames a vertex is on the other side of the cylinder.
    let crossing_in = |is_crossing: fn(usize) -> bool| {
        let mut predicted = truth.clone();
        let crossing = predicted.iter_mut().enumerate().filter(|(t, _)| is_crossing(*t));
        crossing.for_each(|(_, shape)| shape[6 * SECTORS] *= Vec3::new(-1.3, 1.0, -1.3));
        let metrics = cylinder.life(&truth, &predicted, standing).metrics();
        assert_eq!(metrics.self_crossing_edges_percent_truth, Some(0.0));
        metrics.self_crossing_edges_percent.unwrap()
    };
    let (counted, uncounted) = (crossing_in(|t| t % 9 == 0), crossing_in(|t| t % 9 != 0));
    let half = crossing_in(|t| t % 18 == 0);
    assert!(counted > 0.1 && uncounted == 0.0, "{counted} {uncounted}");
    // Of the frames 9, 18 to 99 five in eleven.
    assert_near(half, counted * 5.0 / 11.0, 1e-9);
}

#[test]
fn a_shuffled_truth_is_as_alive_but_does_not_correlate() {
    let cylinder = Cylinder::new(0.12, 0.24, 13);
    let frames = 901;
    let truth = cylinder.shapes(frames, |t| 2e-3 * noise(1)(t));
    // Measured frames stay measured frames: every third one, of which there are 300.
    let shuffled = |t: usize| (t.div_ceil(3) * 119 + 40) % 300 * 3 + 3;
    let predicted: Vec<_> = (0..frames).map(|t| truth[shuffled(t)].clone()).collect();
    for band in cylinder.life(&truth, &predicted, standing).metrics().bands {
        assert_near(band.living_ratio, 1.0, 1e-6);
        assert_near(band.amplitude_ratio, 1.0, 1e-6);
        assert_near(band.correlation.unwrap(), 0.0, 0.15);
    }
}

#[test]
fn rigid_motion_changes_nothing() {
    let cylinder = Cylinder::new(0.12, 0.24, 13);
    let truth = cylinder.shapes(100, |t| 3e-3 * swing(0.9)(t));
    let predicted = cylinder.shapes(100, |t| 2e-3 * swing(1.1)(t));
    let still = cylinder.life(&truth, &predicted, standing).metrics();
    let turn = |t: f32| Quat::from_rotation_y(0.1 * t) * Quat::from_rotation_x(0.02 * t);
    let moving = |t: usize| placed(turn(t as f32), Vec3::new(0.05 * t as f32, -1.0, 2.0));
    let moved = cylinder.life(&truth, &predicted, moving).metrics();
    for (a, b) in still.bands.iter().zip(&moved.bands) {
        assert_near(a.living_ratio, b.living_ratio, 2e-3);
        assert_near(a.amplitude_ratio, b.amplitude_ratio, 2e-3);
        assert_near(a.correlation.unwrap(), b.correlation.unwrap(), 2e-3);
    }
    let others =
        |m: &Metrics| [m.strain_p01_percent, m.strain_p99_percent, m.bending_ratio].map(Option::unwrap);
    for (a, b) in others(&still).into_iter().zip(others(&moved)) {
        assert_near(a, b, 0.06);
    }
    // Second differences change where the motion accelerates, but not in another place.
    let elsewhere = |_| placed(turn(7.0), Vec3::new(-3.0, 0.5, 4.0));
    let placed = cylinder.life(&truth, &predicted, elsewhere).metrics();
    assert_near(placed.popping_ratio.unwrap(), still.popping_ratio.unwrap(), 0.02);
}

#[test]
fn a_scaled_garment_has_its_strain() {
    let cylinder = Cylinder::new(0.12, 0.24, 13);
    let truth = cylinder.shapes(30, |_| 0.0);
    let scaled = |scale: f32| -> Vec<Vec<Vec3>> {
        let scale = |shape: &Vec<Vec3>| shape.iter().map(|v| *v * scale).collect();
        truth.iter().map(scale).collect()
    };
    for (scale, percent) in [(1.1, 10.0), (0.8, -20.0)] {
        let metrics = cylinder.life(&truth, &scaled(scale), standing).metrics();
        for strain in [metrics.strain_p01_percent, metrics.strain_p99_percent] {
            assert_near(strain.unwrap(), percent, 0.06);
        }
        assert_near(metrics.strain_p01_percent_truth.unwrap(), 0.0, 0.06);
        // Scaling turns no face.
        assert_eq!(metrics.bending_ratio, Some(1.0));
        // Neither garment moves.
        for band in &metrics.bands {
            assert_eq!((band.living_ratio, band.correlation), (1.0, None));
        }
    }
}

#[test]
fn a_short_clip_has_no_autocorrelation() {
    let cylinder = Cylinder::new(0.12, 0.24, 13);
    let truth = cylinder.shapes(60, |t| 2e-3 * swing(0.7)(t));
    let metrics = cylinder.life(&truth, &truth, standing).metrics();
    assert!(metrics.bands.iter().all(|band| band.autocorrelation_1s.is_none()));
    // A clip without a measured frame has no measures at all.
    let metrics = cylinder.life(&truth[..3], &truth[..3], standing).metrics();
    assert!(metrics.bands.iter().all(|band| band.living_ratio.is_nan()));
    assert!(metrics.strain_p99_percent.is_some_and(f64::is_nan));
}

#[test]
fn a_diverged_prediction_gives_nan() {
    let cylinder = Cylinder::new(0.12, 0.24, 13);
    let truth = cylinder.shapes(70, |t| 2e-3 * swing(0.7)(t));
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let mut predicted = truth.clone();
        predicted[30][5].y = bad;
        let metrics = cylinder.life(&truth, &predicted, standing).metrics();
        for band in &metrics.bands {
            assert!(
                band.living_ratio.is_nan() && band.amplitude_ratio.is_nan(),
                "{band:?}"
            );
            assert!(band.autocorrelation_1s_truth.is_some_and(f64::is_finite));
        }
        assert_eq!(metrics.strain_p99_percent.unwrap().is_nan(), !bad.is_finite());
    }
}

#[test]
fn the_judge_sees_amplitudes_but_no_other_history() {
    let cylinder = Cylinder::new(0.12, 0.24, 13);
    let history = |seed: u64, amplitude: f32| {
        let noise = noise(seed);
        cylinder.shapes(481, move |t| amplitude * noise(t))
    };
    let percents = |amplitude: f32| {
        let clip = |seed: u64| {
            let (truth, other) = (history(seed, 2e-3), history(seed + 10, 2e-3 * amplitude));
            let mut windows = cylinder.life(&truth, &other, standing).windows;
            // Ridge regression stands for a garment that does not wrinkle.
            let still = cylinder.shapes(481, |_| 0.0);
            let ridge = cylinder.life(&truth, &still, standing).windows;
            windows.predicted.extend(ridge.predicted);
            windows
        };
        let clips: Vec<ClipWindows> = (0..4).map(clip).collect();
        judge([MODEL, RIDGE].into_iter(), &clips)
    };
    let (same, scaled) = (percents(1.0), percents(0.5));
    assert!(
        (30.0..70.0).contains(&same.judge_accuracy_percent.unwrap()),
        "{same:?}"
    );
    assert!(scaled.judge_accuracy_percent.unwrap() > 95.0, "{scaled:?}");
    assert_eq!(scaled.judge_ridge_percent, Some(100.0));
}

#[test]
fn the_living_ratio_of_a_training_is_that_of_the_metrics() {
    let cylinder = Cylinder::new(0.08, 0.4, 41);
    let swing = |t: usize| 0.002 * (0.4 * t as f32).sin();
    let truth = cylinder.shapes(90, swing);
    let measure = LivingMeasure::new(&cylinder.garment.rest).unwrap();
    let of = |shapes: &[Vec<Vec3>]| {
        let frames: Vec<_> = shapes.iter().step_by(3).map(Vec::as_slice).collect();
        measure.liveliness(&frames)
    };
    let found = |shapes: &[Vec<Vec3>]| of(shapes).ratio(&of(&truth));
    for factor in [0.5, 1.0, 2.0] {
        // What does not move is no life.
        let predicted = cylinder.shapes(90, |t| 0.001 + factor * swing(t));
        let ratio = found(&predicted).unwrap();
        assert!(
            (ratio / f64::from(factor) - 1.0).abs() < 0.02,
            "{ratio}, {factor}"
        );
        let metrics = cylinder.life(&truth, &predicted, standing).metrics();
        let bands = metrics.bands[1..4].iter().map(|band| band.living_ratio.ln());
        let expected = (bands.sum::<f64>() / 3.0).exp();
        assert!((ratio / expected - 1.0).abs() < 0.01, "{ratio}, {expected}");
    }
    let short = of(&truth[..15]);
    assert_eq!(short.ratio(&short), None, "five frames");
    let still = cylinder.shapes(90, |_| 0.002);
    assert_eq!(of(&truth).ratio(&of(&still)), None);
}
