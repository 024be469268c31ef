//! Strain of a garment's edges and bending of its hinges against the rest shape.

use super::{histogram::Histogram, welded::WeldedMesh};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use unic_core::{mesh::TriMesh, topology::edges};

/// Shortest rest edge whose strain counts, metres. The strain of shorter edges has no meaning.
const LEAST_EDGE: f64 = 1e-6;

/// Least strain in a histogram: an edge of no length.
const LEAST_STRAIN: f64 = -1.0;
/// Width of a bin of strain, 0.05 %.
const STRAIN_BIN: f64 = 5e-4;
/// Number of bins: the largest strain is 300 %.
const STRAIN_BINS: usize = 8_000;

/// Edges and hinges of a garment with their lengths and angles at rest.
#[derive(Clone, Debug)]
pub(super) struct Cloth {
    edges: Vec<RestEdge>,
    hinges: Vec<Hinge>,
}

/// Edge of the garment with its rest length.
#[derive(Clone, Debug)]
struct RestEdge {
    /// Garment vertices.
    ends: [u32; 2],
    /// Rest length, metres.
    length: f64,
}

/// Edge between two faces of the welded garment with the angle between them at rest.
#[derive(Clone, Debug)]
struct Hinge {
    /// Garment vertices: both ends of the edge, the third corner of the face that runs along the
    /// edge, the third corner of the other face.
    vertices: [u32; 4],
    /// Angle between the faces' normals at rest, radians.
    rest_angle: f64,
}

/// Strain and bending of one shape.
#[derive(Clone, Debug)]
pub(super) struct ClothFrame {
    /// Signed strains of all edges: length / rest length − 1.
    pub(super) strains: Histogram,
    /// Mean strain.
    pub(super) mean_strain: f64,
    /// Standard deviation of the strains.
    pub(super) strain_deviation: f64,
    /// Mean over hinges of the squared difference of the angle from that at rest, rad².
    pub(super) squared_bending: f64,
}

/// Makes an empty histogram of strains.
pub(super) fn strain_histogram() -> Histogram {
    Histogram::new(LEAST_STRAIN, STRAIN_BIN, STRAIN_BINS)
}

impl Cloth {
    /// Measures a rest mesh and its welded form.
    pub(super) fn new(rest: &TriMesh, welded: &WeldedMesh) -> Self {
        let edge = |ends: [u32; 2]| RestEdge {
            ends,
            length: length(&rest.vertices, ends),
        };
        let edges = edges(&rest.faces).into_iter().map(edge);
        let hinge = |vertices: [u32; 4]| {
            let vertices = vertices.map(|v| welded.vertices[v as usize]);
            let rest_angle = dihedral_angle(&rest.vertices, vertices);
            Hinge { vertices, rest_angle }
        };
        Self {
            edges: edges.filter(|edge| edge.length > LEAST_EDGE).collect(),
            hinges: hinges(&welded.rest.faces).into_iter().map(hinge).collect(),
        }
    }

    /// Measures a shape, given by the positions of all garment vertices in metres.
    pub(super) fn measure(&self, positions: &[Vec3]) -> ClothFrame {
        let (mut strains, mut sum, mut squares) = (strain_histogram(), 0.0, 0.0);
        for edge in &self.edges {
            let strain = length(positions, edge.ends) / edge.length - 1.0;
            strains.add(strain);
            sum += strain;
            squares += strain * strain;
        }
        let count = self.edges.len().max(1) as f64;
        let mean = sum / count;
        let variance = squares / count - mean * mean;
        ClothFrame {
            strains,
            mean_strain: mean,
            // Rounding may leave a variance below zero. `max` would replace NaN by 0.
            strain_deviation: if variance < 0.0 { 0.0 } else { variance.sqrt() },
            squared_bending: self.squared_bending(positions),
        }
    }

    /// Returns the mean over hinges of the squared difference of the angle from that at rest, rad²,
    /// given the positions of all garment vertices in metres.
    pub(super) fn squared_bending(&self, positions: &[Vec3]) -> f64 {
        let bending = self.hinges.iter().map(|hinge| {
            let angle = dihedral_angle(positions, hinge.vertices) - hinge.rest_angle;
            // The difference of two angles may leave [−π, π] by one turn.
            let nearest = angle - TAU * ((angle + PI) / TAU).floor();
            nearest * nearest
        });
        bending.sum::<f64>() / self.hinges.len().max(1) as f64
    }
}

/// Returns the length of an edge, metres.
fn length(positions: &[Vec3], [a, b]: [u32; 2]) -> f64 {
    positions[a as usize]
        .as_dvec3()
        .distance(positions[b as usize].as_dvec3())
}

/// Returns the signed angle between the normals of the faces (a, b, c) and (b, a, d), radians:
/// above zero where the faces fold towards their back.
fn dihedral_angle(positions: &[Vec3], vertices: [u32; 4]) -> f64 {
    // In f64: products of three lengths of millimetres are small beside the resolution of f32.
    let [a, b, c, d]: [DVec3; 4] = vertices.map(|v| positions[v as usize].as_dvec3());
    let edge = b - a;
    let normals = [edge.cross(c - a), (d - a).cross(edge)];
    let sine = normals[0].cross(normals[1]).dot(edge.normalize_or_zero());
    sine.atan2(normals[0].dot(normals[1]))
}

/// Side of a face along an edge.
#[derive(Clone, Copy)]
struct FaceSide {
    /// Ends of the edge, the lower index first.
    edge: [u32; 2],
    /// Whether the face runs from the lower index to the higher.
    is_forward: bool,
    /// Third corner of the face.
    opposite: u32,
}

/// Lists the hinges of a mesh: vertices a, b, c, d of the faces (a, b, c) and (b, a, d).
///
/// Edges of one face, of more than two faces, and of two faces that face opposite ways have no
/// angle and are left out.
fn hinges(faces: &[[u32; 3]]) -> Vec<[u32; 4]> {
    let sides = |&[a, b, c]: &[u32; 3]| {
        [(a, b, c), (b, c, a), (c, a, b)].map(|(from, to, opposite)| FaceSide {
            edge: [from.min(to), from.max(to)],
            is_forward: from < to,
            opposite,
        })
    };
    let mut sides: Vec<FaceSide> = faces.iter().flat_map(sides).collect();
    sides.sort_by_key(|side| (side.edge, !side.is_forward));
    let of_edge = |sides: &[FaceSide]| match sides {
        [forward, backward] if forward.is_forward && !backward.is_forward => {
            let [a, b] = forward.edge;
            Some([a, b, forward.opposite, backward.opposite])
        }
        _ => None,
    };
    sides
        .chunk_by(|x, y| x.edge == y.edge)
        .filter_map(of_edge)
        .collect()
}
