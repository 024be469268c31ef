//! Contract of the three complex garments: valid meshes of the requested size whose layers do not
//! touch each other or the body, and whose patterns have the areas of the rest shape.
//!
//! Bodies are the built-in human and, if its file exists, a real body in an A-pose.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod mesh_checks;

use glam::{IVec3, Vec3};
use mesh_checks::*;
use std::collections::HashMap;
use unic_builtin::{
    garments::{FlaredSkirt, GarmentError, GarmentMesh, PleatedDress, Robe, TShirt, TulleSkirt},
    human::{HumanParameters, human},
};
use unic_core::{
    character::Character,
    config::ProjectionConfig,
    mesh::TriMesh,
    projection::{StrainLimit, StrainProjection, limited_pairs},
    surface::Surface,
    topology::edges,
};

fn characters() -> Vec<(&'static str, Character)> {
    let built_in = human(&HumanParameters::default()).unwrap();
    let mut all = vec![("built-in", built_in)];
    all.extend(real_character().map(|real| ("real", real)));
    all
}

/// Expected properties of a garment.
struct Expected {
    /// Number of vertices.
    vertices: std::ops::RangeInclusive<usize>,
    /// Number of connected components.
    components: usize,
    /// Number of closed borders.
    loops: usize,
    /// Least distance of a vertex from the skin, metres.
    clearance: f32,
}

fn assert_sound(name: &str, character: &Character, garment: &GarmentMesh, expected: &Expected) {
    let mesh = &garment.mesh;
    let count = mesh.vertices.len();
    assert!(expected.vertices.contains(&count), "{name}: {count} vertices");
    mesh.check().unwrap();
    assert_manifold(count, &mesh.faces);
    assert_eq!(component_count(count, &mesh.faces), expected.components, "{name}");
    assert_eq!(boundary_loops(&mesh.faces), expected.loops, "{name}");
    // Every component is a sphere with holes.
    let euler = 2 * expected.components as i64 - expected.loops as i64;
    assert_eq!(euler_characteristic(count, &mesh.faces), euler, "{name}");
    assert_well_shaped(name, garment);
    let crossings = crossings(mesh);
    assert!(
        crossings.is_empty(),
        "{name}: {} edges cross, such as {:?}",
        crossings.len(),
        crossings[0]
    );
    let body = Surface::build(&character.body);
    let clearance = mesh
        .vertices
        .iter()
        .filter_map(|&v| body.closest(v))
        .map(|hit| hit.signed_distance);
    let clearance = clearance.fold(f32::MAX, f32::min);
    eprintln!("{name}: {:.1} mm from the skin", clearance * 1e3);
    assert!(clearance > expected.clearance, "{name}: {clearance}");
    assert_eq!(garment.part_of_vertex.len(), count);
    for part in 0..garment.parts.len() as u32 {
        assert!(
            garment.vertices_of(part).next().is_some(),
            "{name}: an empty part"
        );
    }
    assert!(
        garment
            .part_of_vertex
            .iter()
            .all(|p| (*p as usize) < garment.parts.len())
    );
}

fn assert_well_shaped(name: &str, garment: &GarmentMesh) {
    let mesh = &garment.mesh;
    let angles = smallest_angles(&mesh.vertices, &mesh.faces);
    let lengths = edge_lengths(&mesh.vertices, &mesh.faces);
    let areas = area_ratios(garment);
    let mean = lengths.iter().sum::<f32>() / lengths.len() as f32;
    let at = |sorted: &[f32], share: f32| sorted[(share * (sorted.len() - 1) as f32) as usize];
    eprintln!(
        "{name}: {} vertices, edges {:.1} mm x {:.2} to {:.2} (1 to 99 %: {:.2} to {:.2}), \
         angles from {:.1} (1 %: {:.1}), pattern areas (1, 50, 99 %) {:.2} {:.2} {:.2}",
        mesh.vertices.len(),
        mean * 1e3,
        lengths[0] / mean,
        at(&lengths, 1.0) / mean,
        at(&lengths, 0.01) / mean,
        at(&lengths, 0.99) / mean,
        angles[0],
        at(&angles, 0.01),
        at(&areas, 0.01),
        at(&areas, 0.5),
        at(&areas, 0.99),
    );
    assert!(
        at(&lengths, 0.01) > 0.5 * mean && at(&lengths, 0.99) < 2.0 * mean,
        "{name}: edges"
    );
    assert!(at(&angles, 0.01) > 20.0, "{name}: angles");
    assert!(
        at(&areas, 0.05) > 0.75 && at(&areas, 0.95) < 1.3,
        "{name}: pattern"
    );
}

/// Pattern area over rest area of each face, ascending; negative where the pattern is mirrored.
fn area_ratios(garment: &GarmentMesh) -> Vec<f32> {
    let (mesh, uvs) = (&garment.mesh, garment.mesh.uvs.as_ref().unwrap());
    let ratio = |(face, corners): (&[u32; 3], &[u32; 3])| {
        let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
        let [p, q, r] = corners.map(|c| uvs.coordinates[c as usize]);
        (q - p).perp_dot(r - p) / (b - a).cross(c - a).length()
    };
    let mut ratios: Vec<f32> = mesh.faces.iter().zip(&uvs.faces).map(ratio).collect();
    ratios.sort_by(f32::total_cmp);
    ratios
}

/// Edges that pass through a face with which they share no vertex.
fn crossings(mesh: &TriMesh) -> Vec<([u32; 2], [u32; 3])> {
    const CELL_M: f32 = 0.012;
    let cells = |corners: &[Vec3]| {
        let low = corners.iter().fold(Vec3::MAX, |l, p| l.min(*p)) / CELL_M;
        let high = corners.iter().fold(Vec3::MIN, |h, p| h.max(*p)) / CELL_M;
        let (low, high) = (low.floor().as_ivec3(), high.floor().as_ivec3());
        (low.x..=high.x).flat_map(move |x| {
            (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| IVec3::new(x, y, z)))
        })
    };
    let mut faces_of: HashMap<IVec3, Vec<usize>> = HashMap::new();
    for (i, face) in mesh.faces.iter().enumerate() {
        for cell in cells(&face.map(|v| mesh.vertices[v as usize])) {
            faces_of.entry(cell).or_default().push(i);
        }
    }
    let mut found = Vec::new();
    for edge in edges(&mesh.faces) {
        let ends = edge.map(|v| mesh.vertices[v as usize]);
        let near = cells(&ends).filter_map(|cell| faces_of.get(&cell)).flatten();
        for face in near.map(|&i| mesh.faces[i]) {
            let is_apart = !face.iter().any(|v| edge.contains(v));
            if is_apart && crosses(ends, face.map(|v| mesh.vertices[v as usize])) {
                found.push((edge, face));
            }
        }
    }
    found
}

/// Returns true if a segment passes through the interior of a triangle.
fn crosses([p, q]: [Vec3; 2], [a, b, c]: [Vec3; 3]) -> bool {
    // The ends lie on different sides of the plane, and the line passes the edges on the same side.
    let volume = |a: Vec3, b: Vec3, c: Vec3, d: Vec3| (b - a).cross(c - a).dot(d - a);
    let sides = [volume(a, b, c, p), volume(a, b, c, q)];
    let turns = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    sides[0] * sides[1] < 0.0 && (turns.iter().all(|t| *t > 0.0) || turns.iter().all(|t| *t < 0.0))
}

/// Least distance between the vertices of one part and the faces of others, metres.
fn separation(garment: &GarmentMesh, part: &str, from: &[&str]) -> f32 {
    let from: Vec<u32> = from.iter().map(|name| garment.part(name).unwrap()).collect();
    let mesh = &garment.mesh;
    let of = |v: &u32| garment.part_of_vertex[*v as usize];
    let faces = mesh
        .faces
        .iter()
        .filter(|f| f.iter().all(|v| from.contains(&of(v))));
    let mut used = HashMap::new();
    let mut vertices = Vec::new();
    let mut number = |v: u32| {
        *used.entry(v).or_insert_with(|| {
            vertices.push(mesh.vertices[v as usize]);
            vertices.len() as u32 - 1
        })
    };
    let faces = faces.map(|f| f.map(&mut number)).collect();
    let surface = Surface::build(&TriMesh::new(vertices, faces).unwrap());
    let vertices = garment.vertices_of(garment.part(part).unwrap());
    let distances = vertices.filter_map(|v| surface.closest(mesh.vertices[v as usize]));
    distances.map(|hit| hit.distance).fold(f32::MAX, f32::min)
}

#[test]
fn pleated_dresses_are_sound() {
    for (name, character) in characters() {
        let dress = PleatedDress::default();
        let garment = dress.make(&character).unwrap();
        // Hem, neck, two armholes, and an opening behind each pleat.
        let expected = Expected {
            vertices: 34_000..=36_000,
            components: 1,
            loops: 4 + dress.pleats,
            clearance: 0.001,
        };
        assert_sound(&format!("dress on {name}"), &character, &garment, &expected);
        let waist = &garment.attachments[0];
        assert_eq!(waist.name, "waist");
        let heights = waist
            .vertices
            .iter()
            .map(|&v| garment.mesh.vertices[v as usize].y);
        let (low, high) = heights.fold((f32::MAX, f32::MIN), |(l, h), y| (l.min(y), h.max(y)));
        assert!(high - low < 0.002);
        let [left, right] = ["strap_left", "strap_right"].map(|name| {
            let part = garment.part(name).unwrap();
            garment
                .vertices_of(part)
                .map(|v| garment.mesh.vertices[v as usize].x)
                .collect::<Vec<_>>()
        });
        assert_eq!(left.len(), right.len());
        assert!(left.iter().all(|x| *x > 0.0) && right.iter().all(|x| *x < 0.0));
    }
}

#[test]
fn tulle_skirts_are_sound() {
    for (name, character) in characters() {
        let garment = TulleSkirt::default().make(&character).unwrap();
        let expected = Expected {
            vertices: 58_000..=60_000,
            components: 4,
            loops: 8,
            clearance: 0.002,
        };
        assert_sound(&format!("tulle on {name}"), &character, &garment, &expected);
        for layer in 1..4 {
            let [inner, outer] = [layer, layer + 1].map(|l| format!("layer_{l}"));
            let apart = separation(&garment, &outer, &[inner.as_str()]);
            eprintln!("tulle on {name}: {outer} {:.1} mm from {inner}", apart * 1e3);
            assert!(apart > 0.002, "{name}: {outer} is {apart} from {inner}");
        }
        let names: Vec<&str> = garment.attachments.iter().map(|a| a.name.as_str()).collect();
        assert_eq!(names, ["waistband", "layer_tops"]);
    }
}

#[test]
fn robes_are_sound() {
    for (name, character) in characters() {
        let garment = Robe::default().make(&character).unwrap();
        // The robe's outline and two sleeves; the sash's lower edge, and its upper one with the
        // ties.
        let expected = Expected {
            vertices: 61_000..=63_000,
            components: 2,
            loops: 5,
            clearance: 0.001,
        };
        assert_sound(&format!("robe on {name}"), &character, &garment, &expected);
        let under_sash = ["front_left", "front_right", "back", "collar"];
        let pairs: [(&str, &[&str]); 4] = [
            ("front_left", &["front_right"]),
            ("sash", &under_sash),
            ("tie_left", &under_sash),
            ("tie_left", &["tie_right"]),
        ];
        for (part, from) in pairs {
            let apart = separation(&garment, part, from);
            eprintln!("robe on {name}: {part} {:.1} mm from {from:?}", apart * 1e3);
            assert!(apart > 0.002, "{name}: {part} is {apart} from {from:?}");
        }
        let names: Vec<&str> = garment.attachments.iter().map(|a| a.name.as_str()).collect();
        assert_eq!(names, ["sash", "waist"]);
    }
}

/// Share of the vertices of a garment that the strain projection keeps in the order of their layers.
fn layered_share(garment: &GarmentMesh) -> f32 {
    let config = ProjectionConfig {
        coarse_sweeps: 0,
        ..ProjectionConfig::default()
    };
    let length = StrainLimit {
        shortest: 0.0,
        longest: f32::MAX,
    };
    let rest = &garment.mesh;
    let limits = limited_pairs(&config, rest).iter().map(|_| length).collect();
    let projection = StrainProjection::new(config, rest, None, limits).unwrap();
    let layered = projection.layers().map_or(0, |layers| {
        let pushed = layers.places().iter().filter(|place| place.side != 0.0);
        pushed.count()
    });
    layered as f32 / rest.vertices.len() as f32
}

#[test]
fn the_strain_projection_knows_which_garments_have_layers() {
    let body = human(&HumanParameters::default()).unwrap();
    let shirt = TShirt::default().make(&body).unwrap();
    let skirt = FlaredSkirt::default().make(&body).unwrap();
    assert_eq!([shirt, skirt].map(|garment| layered_share(&garment)), [0.0; 2]);
    let dress = PleatedDress::default().make(&body).unwrap();
    let tulle = TulleSkirt::default().make(&body).unwrap();
    let robe = Robe::default().make(&body).unwrap();
    let shares = [dress, tulle, robe].map(|garment| layered_share(&garment));
    // The pleats of the dress without the edges of their folds, all of the tulle but its waistband, and
    // the sash, the collar and the lap of the robe.
    assert!(
        shares[0] > 0.4 && shares[1] > 0.5 && (0.02..0.5).contains(&shares[2]),
        "{shares:?}"
    );
}

#[test]
fn garments_are_the_same_every_time() {
    let character = human(&HumanParameters::default()).unwrap();
    let small = Robe {
        vertices: 10_000,
        ..Default::default()
    };
    assert_eq!(small.make(&character).unwrap(), small.make(&character).unwrap());
    let small = TulleSkirt {
        vertices: 8_000,
        ..Default::default()
    };
    assert_eq!(small.make(&character).unwrap(), small.make(&character).unwrap());
}

#[test]
fn parameters_out_of_range_are_refused() {
    let character = human(&HumanParameters::default()).unwrap();
    let is_parameter = |made: Result<GarmentMesh, GarmentError>, wanted: &str| matches!(made, Err(GarmentError::Parameter { name, .. }) if name == wanted);
    let dress = PleatedDress {
        pleats: 3,
        ..Default::default()
    };
    assert!(is_parameter(dress.make(&character), "pleats"));
    let skirt = TulleSkirt {
        gather: f32::NAN,
        ..Default::default()
    };
    assert!(is_parameter(skirt.make(&character), "gather"));
    let robe = Robe {
        vertices: 100,
        ..Default::default()
    };
    assert!(is_parameter(robe.make(&character), "vertices"));
}
