//! Checks of a garment's rest shape on a body, and of another mesh of the same garment.

use super::{mesh, meshes::bounds};
use crate::finding::{Finding, units::median};
use glam::{Mat3, Quat, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};
use unic_core::{character::Character, mesh::TriMesh, surface::Surface};

/// Number of vertices whose distances are computed. Means and shares need no more.
const SAMPLES: usize = 500;

/// Largest mean distance between garment and body, as a share of the body's height.
const MAX_MEAN_DISTANCE: f32 = 0.15;
/// Largest distance of the nearest tenth of the vertices, as a share of the body's height. A wide
/// skirt is far from the body on average, and its waist is near.
const MAX_NEAR_DISTANCE: f32 = 0.05;
/// Share of the vertices that counts as the nearest part.
const NEAR_SHARE: f32 = 0.1;

/// A garment faces backwards if turning it by 180° divides its vertices inside the body by at least
/// this factor.
const MIN_FACING_RATIO: f32 = 3.0;
/// Smallest share of vertices inside the body at which the facing is checked.
const MIN_FACING_INSIDE: f32 = 0.1;

/// Plausible extents of garments, as shares of the body's height.
const SIZES: std::ops::RangeInclusive<f32> = 0.1..=2.0;

/// Largest share of vertices deeper than [`DEEP_M`] inside the body, in its bind pose.
const MAX_INSIDE: f32 = 0.3;
/// Depth inside the body from which a vertex counts, metres. Cloth that touches the body is
/// shallower.
const DEEP_M: f32 = 0.005;

/// Largest median distance between two meshes of one garment, as a share of its extent.
const MAX_MESH_DISTANCE: f32 = 0.05;

/// A mistake in the export of a mesh.
struct ImportMistake {
    /// Name for messages.
    name: &'static str,
    /// Remedy for messages.
    remedy: &'static str,
    /// Transform that undoes the mistake.
    undo: Mat3,
}

/// Returns the mistakes that are tried on a mesh that does not fit.
fn import_mistakes() -> [ImportMistake; 6] {
    let turned = |turn: Quat| Mat3::from_quat(turn);
    let scaled = |scale: f32| Mat3::from_diagonal(Vec3::splat(scale));
    // Single mistakes only: with combinations of them nearly any mesh would fit somewhere.
    [
        ImportMistake {
            name: "Z up",
            remedy: "export with Y up, or turn the mesh by -90 degrees about X",
            undo: turned(Quat::from_rotation_x(-FRAC_PI_2)),
        },
        ImportMistake {
            name: "turned twice from Z up to Y up",
            remedy: "turn the mesh by 90 degrees about X",
            undo: turned(Quat::from_rotation_x(FRAC_PI_2)),
        },
        ImportMistake {
            name: "facing -Z",
            remedy: "turn the mesh by 180 degrees about Y",
            undo: turned(Quat::from_rotation_y(PI)),
        },
        ImportMistake {
            name: "centimetres",
            remedy: "scale the mesh by 0.01 to metres",
            undo: scaled(0.01),
        },
        ImportMistake {
            name: "millimetres",
            remedy: "scale the mesh by 0.001 to metres",
            undo: scaled(0.001),
        },
        ImportMistake {
            name: "hundredths of the right size",
            remedy: "scale the mesh by 100 to metres",
            undo: scaled(100.0),
        },
    ]
}

/// Checks a garment's rest shape, and its place on the body in its bind pose.
pub fn garment(rest: &TriMesh, character: &Character) -> Vec<Finding> {
    let mut findings = mesh("garment", rest);
    let body = FitBody::new(&character.body);
    let fit = body.fit(sampled(rest));
    match misplaced(&body, rest, fit) {
        // A garment of a wrong unit also has a wrong extent: one finding for one mistake.
        Some(finding) => {
            findings.retain(|finding| !finding.found.contains("an extent of"));
            findings.push(finding);
        }
        None => findings.extend(facing_backwards(&body, rest, fit).or_else(|| inside_body(fit))),
    }
    findings
}

/// Distances of a garment from a body.
#[derive(Clone, Copy, Debug)]
struct FitStatistics {
    /// Mean distance from the skin, metres.
    distance: f32,
    /// Distance within which the nearest tenth of the vertices lies, metres.
    nearest: f32,
    /// Share of vertices deeper than [`DEEP_M`].
    inside: f32,
}

/// A body that garments are fitted on.
struct FitBody {
    surface: Surface,
    /// Largest extent along an axis, metres.
    height: f32,
}

impl FitBody {
    fn new(body: &TriMesh) -> Self {
        let size = bounds(&body.vertices).map_or(Vec3::ZERO, |(low, high)| high - low);
        Self {
            surface: Surface::build(body),
            height: size.max_element(),
        }
    }

    /// Measures points of a garment. Without points the distances are 0 and infinite, and nothing
    /// is far.
    fn fit(&self, points: impl Iterator<Item = Vec3>) -> FitStatistics {
        let signed = points.filter_map(|point| Some(self.surface.closest(point)?.signed_distance));
        let signed: Vec<f32> = signed.collect();
        let count = signed.len().max(1) as f32;
        let mut distances: Vec<f32> = signed.iter().map(|d| d.abs()).collect();
        // Distances to the skin count as positive on both sides.
        distances.sort_by(f32::total_cmp);
        let nearest = distances.get((NEAR_SHARE * count) as usize);
        FitStatistics {
            distance: distances.iter().sum::<f32>() / count,
            nearest: nearest.copied().unwrap_or(f32::INFINITY),
            inside: signed.iter().filter(|d| **d < -DEEP_M).count() as f32 / count,
        }
    }

    fn is_far(&self, fit: FitStatistics) -> bool {
        fit.distance > MAX_MEAN_DISTANCE * self.height && fit.nearest > MAX_NEAR_DISTANCE * self.height
    }
}

/// Returns up to [`SAMPLES`] vertices, evenly spaced in the mesh's order.
fn sampled(mesh: &TriMesh) -> impl Iterator<Item = Vec3> + Clone {
    let stride = mesh.vertices.len().div_ceil(SAMPLES).max(1);
    mesh.vertices.iter().copied().step_by(stride)
}

/// Checks that the garment is near the body, and finds the mistake whose undoing brings it there.
fn misplaced(body: &FitBody, rest: &TriMesh, fit: FitStatistics) -> Option<Finding> {
    if !body.is_far(fit) {
        return None;
    }
    let found = format!("a garment {:.2} m from the body on average", fit.distance);
    let extent = bounds(&rest.vertices).map_or(0.0, |(low, high)| (high - low).max_element());
    // Without this limit a garment scaled down to a point would fit every body at the origin.
    let is_wearable = |undo: Mat3| SIZES.contains(&(undo.x_axis.length() * extent / body.height));
    let undone = import_mistakes().map(|mistake| {
        let fit = body.fit(sampled(rest).map(|v| mistake.undo * v));
        (fit, mistake)
    });
    let fitting = undone
        .into_iter()
        .filter(|(fit, mistake)| !body.is_far(*fit) && fit.inside < MAX_INSIDE && is_wearable(mistake.undo));
    // Several mistakes may bring the garment near; the nearest result is the likeliest.
    let best = fitting.min_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
    let (probably, remedy) = match best {
        Some((_, mistake)) => (mistake.name, mistake.remedy),
        None => (
            "another place than the body's bind pose",
            "move the garment onto the body in its bind pose",
        ),
    };
    Some(Finding::new("garment", found, probably, remedy))
}

/// Checks whether the garment would be far less inside the body if it faced the other way.
fn facing_backwards(body: &FitBody, rest: &TriMesh, fit: FitStatistics) -> Option<Finding> {
    // A garment that faces backwards is near the body, and only its front and back are inside.
    let half_turn = Mat3::from_quat(Quat::from_rotation_y(PI));
    let turned = body.fit(sampled(rest).map(|v| half_turn * v));
    (fit.inside > MIN_FACING_INSIDE && fit.inside > MIN_FACING_RATIO * turned.inside).then(|| {
        Finding::new(
            "garment",
            format!("{:.0} % of its vertices inside the body", 100.0 * fit.inside),
            format!(
                "a garment that faces -Z: turned round {:.0} % are",
                100.0 * turned.inside
            ),
            "turn the mesh by 180 degrees about Y",
        )
    })
}

/// Checks that most of the garment is outside the body.
fn inside_body(fit: FitStatistics) -> Option<Finding> {
    (fit.inside > MAX_INSIDE).then(|| {
        Finding::new(
            "garment",
            format!("{:.0} % of its vertices inside the body", 100.0 * fit.inside),
            "a rest shape of another pose or body",
            "model it around the body in its bind pose",
        )
    })
}

/// Checks another mesh of a garment whose rest shape is `rest`, and its distance from that.
pub fn other_mesh(other: &TriMesh, rest: &TriMesh) -> Vec<Finding> {
    let findings = mesh("mesh", other);
    let surface = Surface::build(rest);
    let extent = bounds(&rest.vertices).map_or(0.0, |(low, high)| (high - low).max_element());
    let is_far = |distance: f32| distance > MAX_MESH_DISTANCE * extent;
    let distance = |undo: Mat3| {
        let points = sampled(other).filter_map(|v| Some(surface.closest(undo * v)?.signed_distance.abs()));
        median(points.collect()).unwrap_or(f32::INFINITY)
    };
    let found = distance(Mat3::IDENTITY);
    // Findings of the mesh itself stand only if its place is right: a wrong unit causes several.
    if !is_far(found) {
        return findings;
    }
    let undone = import_mistakes().map(|mistake| (distance(mistake.undo), mistake));
    let best = undone
        .into_iter()
        .filter(|(distance, _)| !is_far(*distance))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let (probably, remedy) = match best {
        Some((_, mistake)) => (mistake.name, mistake.remedy),
        None => (
            "another garment, or another rest space",
            "use a mesh in the rest space of the model's garment",
        ),
    };
    let found = format!("a mesh {found:.3} m (median) from the model's garment");
    vec![Finding::new("mesh", found, probably, remedy)]
}
