//! Mesh checks that several test files share: topology, symmetry, shape of triangles.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(dead_code, reason = "each test file uses only some of the checks")]

use glam::Vec3;
use std::{collections::HashMap, path::PathBuf};
use unic_core::{
    character::Character,
    topology::{components, edges},
};

/// The real body; none if its file does not exist.
pub(crate) fn real_character() -> Option<Character> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/body/character.npz");
    if !path.exists() {
        eprintln!("skipped: {} is missing", path.display());
        return None;
    }
    Some(unic_io::read_character(&path).unwrap())
}

/// Number of times that each directed edge occurs.
fn directed(faces: &[[u32; 3]]) -> HashMap<(u32, u32), usize> {
    let mut uses = HashMap::new();
    for &[a, b, c] in faces {
        for edge in [(a, b), (b, c), (c, a)] {
            *uses.entry(edge).or_default() += 1;
        }
    }
    uses
}

/// Asserts that every edge has at most one face on either side, and every vertex one fan of faces.
pub(crate) fn assert_manifold(vertices: usize, faces: &[[u32; 3]]) {
    assert!(faces.iter().all(|[a, b, c]| a != b && b != c && c != a));
    assert!(
        directed(faces).values().all(|&n| n == 1),
        "an edge with two faces on one side"
    );
    let mut around = vec![Vec::new(); vertices];
    faces
        .iter()
        .for_each(|f| f.iter().for_each(|&v| around[v as usize].push(*f)));
    for (v, fan) in around.iter().enumerate() {
        assert!(!fan.is_empty(), "vertex {v} has no face");
        // Grows from one face over shared edges at the vertex: every face of the fan must be
        // reached.
        let (mut reached, mut grown) = (vec![fan[0]], true);
        while grown {
            let touches = |f: &[u32; 3]| {
                reached
                    .iter()
                    .any(|r| f.iter().filter(|&&c| c as usize != v && r.contains(&c)).count() > 0)
            };
            let next: Vec<_> = fan
                .iter()
                .filter(|f| !reached.contains(f) && touches(f))
                .copied()
                .collect();
            grown = !next.is_empty();
            reached.extend(next);
        }
        assert_eq!(reached.len(), fan.len(), "vertex {v} joins two fans");
    }
}

/// Number of closed curves that border the mesh.
pub(crate) fn boundary_loops(faces: &[[u32; 3]]) -> usize {
    let uses = directed(faces);
    let mut next: HashMap<u32, u32> = uses
        .keys()
        .filter(|(a, b)| !uses.contains_key(&(*b, *a)))
        .map(|&(a, b)| (a, b))
        .collect();
    let mut loops = 0;
    while let Some(&start) = next.keys().next() {
        let mut at = start;
        while let Some(to) = next.remove(&at) {
            at = to;
        }
        assert_eq!(at, start, "a border that does not close");
        loops += 1;
    }
    loops
}

pub(crate) fn euler_characteristic(vertices: usize, faces: &[[u32; 3]]) -> i64 {
    vertices as i64 + faces.len() as i64 - edges(faces).len() as i64
}

pub(crate) fn component_count(vertices: usize, faces: &[[u32; 3]]) -> usize {
    components(vertices, faces).count
}

pub(crate) fn volume(vertices: &[Vec3], faces: &[[u32; 3]]) -> f32 {
    let corners = faces.iter().map(|f| f.map(|v| vertices[v as usize]));
    corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

/// Asserts that every vertex has its mirror image in x = 0 to the bit, and every face its own.
pub(crate) fn assert_mirror_symmetric(vertices: &[Vec3], faces: &[[u32; 3]]) {
    // Adding 0 turns −0 into 0, which have different bits.
    let key = |p: Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let index: HashMap<_, u32> = vertices
        .iter()
        .enumerate()
        .map(|(i, &p)| (key(p), i as u32))
        .collect();
    let image = |v: u32| {
        let p = vertices[v as usize] * Vec3::new(-1.0, 1.0, 1.0);
        *index
            .get(&key(p))
            .unwrap_or_else(|| panic!("no image of vertex {v}"))
    };
    let turned = |[a, b, c]: [u32; 3]| {
        let least = a.min(b).min(c);
        if least == a {
            [a, b, c]
        } else if least == b {
            [b, c, a]
        } else {
            [c, a, b]
        }
    };
    let all: std::collections::HashSet<_> = faces.iter().map(|&f| turned(f)).collect();
    for &[a, b, c] in faces {
        assert!(all.contains(&turned([image(a), image(c), image(b)])));
    }
}

/// Smallest angle of each face, degrees, ascending.
pub(crate) fn smallest_angles(vertices: &[Vec3], faces: &[[u32; 3]]) -> Vec<f32> {
    let angle = |face: &[u32; 3]| {
        let p = face.map(|v| vertices[v as usize]);
        let at = |k: usize| (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]);
        at(0).min(at(1)).min(at(2)).to_degrees()
    };
    let mut angles: Vec<f32> = faces.iter().map(angle).collect();
    angles.sort_by(f32::total_cmp);
    angles
}

/// Lengths of all edges, metres, ascending.
pub(crate) fn edge_lengths(vertices: &[Vec3], faces: &[[u32; 3]]) -> Vec<f32> {
    let length = |[a, b]: [u32; 2]| vertices[a as usize].distance(vertices[b as usize]);
    let mut lengths: Vec<f32> = edges(faces).into_iter().map(length).collect();
    lengths.sort_by(f32::total_cmp);
    lengths
}
