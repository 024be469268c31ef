//! Contract: remeshing keeps the surface, its borders and its seams, and makes edges near-uniform.
//!
//! The test surface is half a ball: cut at the midplane, cut off at the top, with a seam around it.

use super::*;
use crate::implicit::{Lattice, Mirrored, PositiveSide, mirrored, polygonise};
use unic_core::topology::edges;

const EDGE_M: f32 = 0.02;

fn ball(p: Vec3) -> f32 {
    p.length() - 0.3
}

fn right_of_midplane(p: Vec3) -> f32 {
    -p.x
}

fn above_top(p: Vec3) -> f32 {
    p.y - 0.2
}

fn before_seam(p: Vec3) -> f32 {
    p.z + 0.05
}

const CUTS: [fn(Vec3) -> f32; 3] = [right_of_midplane, above_top, before_seam];

fn remeshed() -> Patch {
    let surfaces = Surfaces {
        surface: &ball,
        cuts: vec![&CUTS[0], &CUTS[1], &CUTS[2]],
    };
    let lattice = Lattice {
        origin: Vec3::new(-0.03, -0.35, -0.35),
        end: Vec3::splat(0.35),
        step: 0.012,
    };
    let (vertices, faces) = polygonise(&ball, lattice);
    let mut patch = Patch::new(vertices, faces);
    patch.cut(&surfaces, 0, &[0], PositiveSide::Remove);
    patch.cut(&surfaces, 1, &[0], PositiveSide::Remove);
    patch.cut(&surfaces, 2, &[0], PositiveSide::Label(1));
    let sizing = Sizing {
        edge: &|_| EDGE_M,
        rounds: 6,
    };
    remesh(&mut patch, &surfaces, sizing);
    patch
}

#[test]
fn vertices_stay_on_the_surface_and_on_their_cuts() {
    let patch = remeshed();
    assert!(patch.bits.iter().any(|bits| bits.count_ones() == 2), "no corner");
    for (&p, &bits) in patch.vertices.iter().zip(&patch.bits) {
        assert!(ball(p).abs() < 1e-4, "{p} off the ball");
        for (cut, field) in CUTS.iter().enumerate() {
            assert!(bits & 1 << cut == 0 || field(p).abs() < 1e-3, "{p} off cut {cut}");
        }
    }
}

#[test]
fn a_half_and_its_mirror_image_make_one_disc() {
    let Mirrored { patch, image } = mirrored(&remeshed(), 0, |label| label);
    let edges = edges(&patch.faces);
    let euler = patch.vertices.len() as i64 + patch.faces.len() as i64 - edges.len() as i64;
    assert_eq!(euler, 1, "a disc");
    let is_own_inverse = |(v, &i): (usize, &u32)| image[i as usize] as usize == v;
    assert!(image.iter().enumerate().all(is_own_inverse));
}

#[test]
fn edges_are_near_the_wanted_length() {
    let patch = remeshed();
    for [a, b] in edges(&patch.faces) {
        let length = patch.vertices[a as usize].distance(patch.vertices[b as usize]);
        let is_near = length > 0.4 * EDGE_M && length < 1.6 * EDGE_M;
        assert!(is_near, "an edge of {length} m");
    }
}

#[test]
fn faces_lie_on_their_own_side_of_the_seam() {
    let patch = remeshed();
    for label in [0, 1] {
        assert!(patch.labels.contains(&label));
    }
    for (face, label) in patch.faces.iter().zip(&patch.labels) {
        let middle = face.iter().map(|&v| patch.vertices[v as usize]).sum::<Vec3>() / 3.0;
        assert_eq!(*label == 1, before_seam(middle) > 0.0);
    }
}
