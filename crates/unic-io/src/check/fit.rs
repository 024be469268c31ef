//! A garment's rest shape on a body, and another mesh of the same garment.

use super::{Finding, lengths, mesh, shapes::bounds};
use glam::{Mat3, Quat, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};
use unic_core::{character::Character, mesh::TriMesh, surface::Surface};

/// Vertices that are looked at: a sample tells as much as all.
const SAMPLES: usize = 500;

/// Garments hang at most so far from the body on average, as a part of the body's height; or their nearest parts lie
/// on it, as the waist of a wide skirt does.
const FAR: f32 = 0.15;
const NEAREST_FAR: f32 = 0.05;
/// Part of the vertices that are nearest.
const NEAREST: f32 = 0.1;

/// A garment that faces the other way has this many times the vertices inside, and so many of them at the least.
const FACING_RATIO: f32 = 3.0;
const FACING_INSIDE: f32 = 0.1;

/// Extents of garments, as parts of the body's height.
const SIZES: std::ops::RangeInclusive<f32> = 0.1..=2.0;

/// A rest shape with more of its vertices deeper than [`DEEP_M`] inside the body is not in its bind pose.
const MOSTLY_INSIDE: f32 = 0.3;
/// Deeper than cloth that touches, metres.
const DEEP_M: f32 = 0.005;

/// Another mesh of a garment lies at most so far from the first, as a part of its extent.
const OTHER_MESH_FAR: f32 = 0.05;

/// A mistake that may have happened to a mesh on its way, with its remedy and the transform that undoes it.
struct Slip {
    name: &'static str,
    remedy: &'static str,
    undo: Mat3,
}

fn slips() -> [Slip; 6] {
    let turned = |turn: Quat| Mat3::from_quat(turn);
    let scaled = |scale: f32| Mat3::from_diagonal(Vec3::splat(scale));
    [
        Slip {
            name: "Z up",
            remedy: "export with Y up, or turn the mesh by -90 degrees about X",
            undo: turned(Quat::from_rotation_x(-FRAC_PI_2)),
        },
        Slip {
            name: "turned twice from Z up to Y up",
            remedy: "turn the mesh by 90 degrees about X",
            undo: turned(Quat::from_rotation_x(FRAC_PI_2)),
        },
        Slip {
            name: "facing -Z",
            remedy: "turn the mesh by 180 degrees about Y",
            undo: turned(Quat::from_rotation_y(PI)),
        },
        Slip {
            name: "centimetres",
            remedy: "scale the mesh by 0.01 to metres",
            undo: scaled(0.01),
        },
        Slip {
            name: "millimetres",
            remedy: "scale the mesh by 0.001 to metres",
            undo: scaled(0.001),
        },
        Slip {
            name: "hundredths of the right size",
            remedy: "scale the mesh by 100 to metres",
            undo: scaled(100.0),
        },
    ]
}

/// Faults of a garment's rest shape, and its place on the body in its bind pose.
pub fn garment(rest: &TriMesh, character: &Character) -> Vec<Finding> {
    let mut findings = mesh("garment", rest);
    let place = Place::on(&character.body);
    let here = place.of(sampled(rest));
    match misplaced(&place, rest, here) {
        // One mistake is told once: the unit names the same.
        Some(finding) => {
            findings.retain(|finding| !finding.found.contains("an extent of"));
            findings.push(finding);
        }
        None => findings.extend(turned_round(&place, rest, here).or_else(|| sunk(here))),
    }
    findings
}

/// How a garment lies on a body.
#[derive(Clone, Copy, Debug)]
struct Fit {
    /// Mean distance from the skin, metres.
    distance: f32,
    /// Distance within which the nearest tenth of the vertices lies, metres.
    nearest: f32,
    /// Share of vertices deeper than [`DEEP_M`].
    inside: f32,
}

struct Place {
    body: Surface,
    height: f32,
}

impl Place {
    fn on(body: &TriMesh) -> Self {
        let size = bounds(&body.vertices).map_or(Vec3::ZERO, |(low, high)| high - low);
        Self {
            body: Surface::build(body),
            height: size.max_element(),
        }
    }

    fn of(&self, points: impl Iterator<Item = Vec3>) -> Fit {
        let signed = points.filter_map(|point| Some(self.body.closest(point)?.signed_distance));
        let signed: Vec<f32> = signed.collect();
        let count = signed.len().max(1) as f32;
        let mut distances: Vec<f32> = signed.iter().map(|d| d.abs()).collect();
        distances.sort_by(f32::total_cmp);
        let nearest = distances.get((NEAREST * count) as usize);
        Fit {
            distance: distances.iter().sum::<f32>() / count,
            nearest: nearest.copied().unwrap_or(f32::INFINITY),
            inside: signed.iter().filter(|d| **d < -DEEP_M).count() as f32 / count,
        }
    }

    fn is_far(&self, fit: Fit) -> bool {
        fit.distance > FAR * self.height && fit.nearest > NEAREST_FAR * self.height
    }
}

fn sampled(mesh: &TriMesh) -> impl Iterator<Item = Vec3> + Clone {
    let stride = mesh.vertices.len().div_ceil(SAMPLES).max(1);
    mesh.vertices.iter().copied().step_by(stride)
}

fn misplaced(place: &Place, rest: &TriMesh, here: Fit) -> Option<Finding> {
    if !place.is_far(here) {
        return None;
    }
    let found = format!("a garment {:.2} m from the body on average", here.distance);
    let extent = bounds(&rest.vertices).map_or(0.0, |(low, high)| (high - low).max_element());
    // A garment of no size is near every body that stands at the origin.
    let is_wearable = |undo: Mat3| SIZES.contains(&(undo.x_axis.length() * extent / place.height));
    let undone = slips().map(|slip| (place.of(sampled(rest).map(|v| slip.undo * v)), slip));
    let fitting = undone
        .into_iter()
        .filter(|(fit, slip)| !place.is_far(*fit) && fit.inside < MOSTLY_INSIDE && is_wearable(slip.undo));
    let best = fitting.min_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
    let (probably, remedy) = match best {
        Some((_, slip)) => (slip.name, slip.remedy),
        None => (
            "another place than the body's bind pose",
            "move the garment onto the body in its bind pose",
        ),
    };
    Some(Finding::new("garment", found, probably, remedy))
}

/// A garment that would be far less inside the body if it faced the other way.
fn turned_round(place: &Place, rest: &TriMesh, here: Fit) -> Option<Finding> {
    let turned = Mat3::from_quat(Quat::from_rotation_y(PI));
    let there = place.of(sampled(rest).map(|v| turned * v));
    (here.inside > FACING_INSIDE && here.inside > FACING_RATIO * there.inside).then(|| {
        Finding::new(
            "garment",
            format!("{:.0} % of its vertices inside the body", 100.0 * here.inside),
            format!(
                "a garment that faces -Z: turned round {:.0} % are",
                100.0 * there.inside
            ),
            "turn the mesh by 180 degrees about Y",
        )
    })
}

fn sunk(here: Fit) -> Option<Finding> {
    (here.inside > MOSTLY_INSIDE).then(|| {
        Finding::new(
            "garment",
            format!("{:.0} % of its vertices inside the body", 100.0 * here.inside),
            "a rest shape of another pose or body",
            "model it around the body in its bind pose",
        )
    })
}

/// Faults of another mesh of a garment whose rest shape is `rest`, and its distance from that.
pub fn other_mesh(other: &TriMesh, rest: &TriMesh) -> Vec<Finding> {
    let findings = mesh("mesh", other);
    let surface = Surface::build(rest);
    let extent = bounds(&rest.vertices).map_or(0.0, |(low, high)| (high - low).max_element());
    let far = |distance: f32| distance > OTHER_MESH_FAR * extent;
    let distance = |undo: Mat3| {
        let points = sampled(other).filter_map(|v| Some(surface.closest(undo * v)?.signed_distance.abs()));
        lengths::median(points.collect()).unwrap_or(f32::INFINITY)
    };
    let here = distance(Mat3::IDENTITY);
    if !far(here) {
        return findings;
    }
    let undone = slips().map(|slip| (distance(slip.undo), slip));
    let best = undone
        .into_iter()
        .filter(|(there, _)| !far(*there))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let (probably, remedy) = match best {
        Some((_, slip)) => (slip.name, slip.remedy),
        None => (
            "another garment, or another rest space",
            "use a mesh in the rest space of the model's garment",
        ),
    };
    let found = format!("a mesh {here:.3} m (median) from the model's garment");
    vec![Finding::new("mesh", found, probably, remedy)]
}
