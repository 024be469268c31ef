//! Robust handling of intersections, after which edges and hinges relax along the body.

use crate::{
    FRAMES, TOLERANCE, common,
    device::{self, gpu_animator},
    largest_offset,
    models::model,
    reset, start, state_error,
};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    Animator, Model, Pose, Start,
    config::{Corrects, IntersectionMode},
    intersection::{Handling, LAST_MARGIN_SHARE, RobustBody, RobustIntersection},
    projection::{Edge, RELAX_ROUNDS, RELAX_SWEEPS, StrainProjection},
};
use unic_gpu::Precision;

fn robust(corrects: Corrects) -> IntersectionMode {
    IntersectionMode::Robust {
        margin_m: 0.003,
        corrects,
    }
}

/// Handling of the shown positions.
pub(crate) const SHOWN: IntersectionMode = IntersectionMode::Robust {
    margin_m: 0.003,
    corrects: Corrects::Display,
};

/// Number of inputs that differ by rounding errors.
const ROUNDINGS: usize = 16;

/// Difference of positions that a device's arithmetic explains, metres.
const ROUNDING_M: f32 = 2e-6;

/// Largest share of vertices that rounding errors may move far, those around them included.
const MAX_UNDECIDED_SHARE: f32 = 5e-3;

/// Numbers of pushes.
#[derive(Debug, Default)]
struct Pushes {
    /// Vertices that the first pass has pushed.
    moved: usize,
    /// Vertices pushed after the sweeps that had been too high for a plane.
    from_afar: usize,
    /// Vertices that the sweeps over the hinges have moved by more than [`TOLERANCE`].
    smoothed: usize,
}

/// Shown garment of a device's robust handling, whose parts are the CPU's: vertices are pushed one by
/// one, edges are brought back towards their limits, hinges smooth the moves, and vertices near the
/// body and those that the sweeps have moved far are pushed again, to a share of the margin.
fn shown(model: &Model, pose: &Pose, handling: &Handling, positions: &mut [Vec3]) -> Pushes {
    let Handling::Robust(rule, body) = handling else {
        panic!()
    };
    let last = RobustIntersection {
        margin_m: LAST_MARGIN_SHARE * rule.margin_m,
    };
    let push = |vertex: usize, p: Vec3| last.correct(body, vertex, p, &mut { Handling::NO_SEED });
    let mut pushes = Pushes::default();
    let uncorrected = positions.to_vec();
    common::correct_each(model, pose, (*rule, body), positions);
    pushes.moved = positions.iter().zip(&uncorrected).filter(|(a, b)| a != b).count();
    if pushes.moved == 0 {
        return pushes;
    }
    let planes: Vec<_> = (positions.iter().enumerate())
        .map(|(vertex, &p)| plane(body, rule.margin_m, vertex, p))
        .collect();
    let projection = model.projection().unwrap();
    let mut relaxed = positions.to_vec();
    let mut by_hinges = vec![Vec3::ZERO; relaxed.len()];
    for _ in 0..RELAX_ROUNDS {
        for sweep in 0..RELAX_SWEEPS {
            sweep_edges(projection, &mut relaxed);
            if sweep == 0 {
                smooth_moves(projection, &uncorrected, &mut relaxed, &mut by_hinges);
            }
        }
        for (p, plane) in relaxed.iter_mut().zip(&planes) {
            if let Some((normal, height)) = plane {
                *p += *normal * (height - normal.dot(*p)).max(0.0);
            }
        }
    }
    pushes.smoothed = by_hinges.iter().filter(|by| by.length() > TOLERANCE).count();
    for (vertex, &first) in projection.first_at_place().iter().enumerate() {
        let p = relaxed[first as usize];
        let may_be_low = planes[vertex].is_some() || p.distance(positions[vertex]) > 0.01;
        let out = may_be_low.then(|| push(vertex, p)).flatten();
        pushes.from_afar += usize::from(planes[vertex].is_none() && out.is_some());
        positions[vertex] = out.unwrap_or(p);
    }
    pushes
}

/// Brings each edge into its limits.
fn sweep_edges(projection: &StrainProjection, positions: &mut [Vec3]) {
    for edge in projection.edge_colours().flatten() {
        let [a, b] = edge.ends.map(|v| v as usize);
        let along = positions[b] - positions[a];
        let wanted = along.length().max(edge.limit.shortest).min(edge.limit.longest);
        let correction = along * (1.0 - wanted / along.length());
        let shares = Edge::shares(edge.ends.map(|end| projection.freedom().of(end)));
        positions[a] += correction * shares[0];
        positions[b] -= correction * shares[1];
    }
}

/// Smooths the moves from the uncorrected positions at each hinge, and adds what hinges move.
fn smooth_moves(
    projection: &StrainProjection,
    uncorrected: &[Vec3],
    positions: &mut [Vec3],
    by_hinges: &mut [Vec3],
) {
    for stencil in projection.stencil_colours().flatten() {
        let vertices = stencil.vertices.iter().map(|&v| v as usize);
        let corners = vertices.zip(stencil.coefficients());
        let sum: Vec3 = (corners.clone())
            .map(|(v, k)| (positions[v] - uncorrected[v]) * k)
            .sum();
        for (v, k) in corners {
            let by = -sum * (stencil.scale() * k * projection.freedom().of(v as u32));
            positions[v] += by;
            by_hinges[v] += by;
        }
    }
}

/// Normal and height of the plane of a vertex near the body.
fn plane(body: &RobustBody, margin: f32, vertex: usize, p: Vec3) -> Option<(Vec3, f32)> {
    let hit = body.closest(vertex, p, Handling::NO_SEED)?;
    let height = (p - hit.point).dot(hit.normal).min(margin);
    let exists = hit.distance < 0.02 && hit.normal != Vec3::ZERO;
    exists.then(|| (hit.normal, hit.point.dot(hit.normal) + height))
}

#[test]
fn edges_and_hinges_relax_along_the_body_after_the_robust_handling() {
    let Some((still, pushes)) = run_robust(&model("second order", 0.17)) else {
        return;
    };
    assert!(
        still == 0 && pushes.moved > 100 && pushes.from_afar > 5 && pushes.smoothed > 100,
        "{still} frames without moves, {pushes:?}"
    );
}

#[test]
fn nothing_relaxes_in_frames_without_corrections() {
    let Some((still, _)) = run_robust(&model("second order", 0.5)) else {
        return;
    };
    assert!(still > 10, "{still} frames without moves");
}

/// Compares the shown garment of a clip with the CPU's parts. Returns the number of frames in which
/// no vertex is pushed, and the numbers of pushes.
fn run_robust(model: &Arc<Model>) -> Option<(usize, Pushes)> {
    let mode = robust(Corrects::Display);
    let (_, mut gpu) = start(model, mode)?;
    let mut cpu = Animator::new(Arc::clone(model));
    let character = model.character();
    let mut handling = Handling::new(mode, character, model.garment());
    let poses = common::motion(FRAMES);
    reset(&mut cpu, &mut gpu);
    let (mut body, mut still, mut pushes) = (Vec::new(), 0, Pushes::default());
    let mut undecided = 0;
    for t in 0..FRAMES {
        if t > 0 {
            cpu.step(&common::input(&poses, t)).unwrap();
            gpu.step(&common::input(&poses, t)).unwrap();
        }
        cpu.body(&mut body);
        handling.pose(character, &body);
        let predicted = cpu.garment().positions.to_vec();
        let mut expected = predicted.clone();
        let now = shown(model, &poses[t], &handling, &mut expected);
        still += usize::from(now.moved == 0);
        pushes.moved += now.moved;
        pushes.from_afar += now.from_afar;
        pushes.smoothed += now.smoothed;
        let found = gpu.read_back().unwrap().positions;
        assert_eq!(found.len(), expected.len());
        let errors_m = found.iter().zip(&expected).map(|(a, b)| a.distance(*b));
        let errors_m: Vec<f32> = errors_m.collect();
        // Of two ways out of the body that are equally long, rounding decides for one.
        if errors_m.iter().any(|&error_m| error_m >= TOLERANCE) {
            let spread_m = spread(&predicted, &expected, |p| {
                _ = shown(model, &poses[t], &handling, p)
            });
            for (v, (&error_m, &spread_m)) in errors_m.iter().zip(&spread_m).enumerate() {
                undecided += usize::from(error_m >= TOLERANCE);
                let is_explained = error_m < TOLERANCE.max(2.0 * spread_m);
                assert!(is_explained, "frame {t}, vertex {v}: {error_m} m, {spread_m} m");
            }
        }
        assert!(errors_m.iter().all(|error_m| error_m.is_finite()), "frame {t}");
        let error = state_error(cpu.state(), &gpu.state().unwrap());
        assert!(error < TOLERANCE, "frame {t}: {error} m");
    }
    let share = undecided as f32 / (FRAMES * cpu.garment().positions.len()) as f32;
    assert!(share <= MAX_UNDECIDED_SHARE, "{share}");
    Some((still, pushes))
}

/// Returns how far each shown vertex moves when the input moves by rounding errors, metres. Rounding
/// decides between two equally long ways.
fn spread(predicted: &[Vec3], expected: &[Vec3], shown: impl Fn(&mut [Vec3])) -> Vec<f32> {
    let mut spread_m = vec![0f32; predicted.len()];
    for k in 0..ROUNDINGS {
        let direction = |v: usize| {
            let angle = (977 * k + v) as f32;
            let direction = Vec3::new(angle.sin(), (1.7 * angle).sin(), (2.3 * angle).sin());
            direction.normalize_or_zero()
        };
        let moved = predicted.iter().enumerate();
        let mut moved: Vec<Vec3> = moved.map(|(v, p)| *p + direction(v) * ROUNDING_M).collect();
        shown(&mut moved);
        for ((spread_m, a), b) in spread_m.iter_mut().zip(&moved).zip(expected) {
            *spread_m = spread_m.max(a.distance(*b));
        }
    }
    spread_m
}

/// Uses eight storage buffers a kernel.
#[test]
fn default_limits_suffice_for_a_projection() {
    let Some(context) = device::context_with_default_limits() else {
        return;
    };
    let model = model("second order", 0.17);
    let mut own = gpu_animator(&context, &model, Precision::F32);
    own.set_intersection(robust(Corrects::State)).unwrap();
    let poses = common::motion(2);
    own.reset(&common::input(&poses, 0), Start::MeanShape).unwrap();
    own.step(&common::input(&poses, 1)).unwrap();
    assert!(largest_offset(&own.state().unwrap()) > 0.01);
}

/// Compares states and offsets, since the CPU also lifts shown faces.
#[test]
fn corrected_states_are_those_of_the_cpu() {
    // With 0.17 m a vertex comes to two body faces that are equally near but for rounding, and the
    // devices choose different ones.
    let model = model("second order", 0.18);
    let Some((mut cpu, mut gpu)) = start(&model, robust(Corrects::State)) else {
        return;
    };
    let poses = common::motion(FRAMES);
    reset(&mut cpu, &mut gpu);
    let mut largest = 0f32;
    for t in 1..FRAMES {
        cpu.step(&common::input(&poses, t)).unwrap();
        gpu.step(&common::input(&poses, t)).unwrap();
        largest = largest.max(state_error(cpu.state(), &gpu.state().unwrap()));
    }
    assert!(largest < TOLERANCE, "{largest} m");
}
