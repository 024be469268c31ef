//! Contract of T-shirt and skirt: valid meshes outside the body whose patterns have the areas of
//! the rest shape.
//!
//! Bodies are two built-in humans and, if its file exists, a real body in an A-pose.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod mesh_checks;

use mesh_checks::*;
use unic_builtin::{
    garments::{FlaredSkirt, GarmentError, GarmentMesh, TShirt},
    human::{HumanParameters, human},
};
use unic_core::{character::Character, surface::Surface};

fn characters() -> Vec<(&'static str, Character)> {
    let built_in = human(&HumanParameters::default()).unwrap();
    let slender = human(&HumanParameters {
        height_m: 1.85,
        waist_m: 0.78,
        ..Default::default()
    });
    let mut all = vec![("built-in", built_in), ("slender", slender.unwrap())];
    all.extend(real_character().map(|real| ("real", real)));
    all
}

/// Depth inside the body of the deepest vertex, metres; negative when all are outside.
fn depth(character: &Character, garment: &GarmentMesh) -> f32 {
    let body = Surface::build(&character.body);
    let distances = garment.mesh.vertices.iter().filter_map(|&v| body.closest(v));
    distances.map(|hit| -hit.signed_distance).fold(f32::MIN, f32::max)
}

/// Pattern area over rest area of each face, ascending.
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

fn assert_sound(name: &str, garment: &GarmentMesh, loops: usize) {
    let mesh = &garment.mesh;
    mesh.check().unwrap();
    assert_manifold(mesh.vertices.len(), &mesh.faces);
    assert_eq!(component_count(mesh.vertices.len(), &mesh.faces), 1);
    assert_eq!(boundary_loops(&mesh.faces), loops, "{name}");
    // A sphere with holes.
    let euler = euler_characteristic(mesh.vertices.len(), &mesh.faces);
    assert_eq!(euler, 2 - loops as i64, "{name}");
    let (angles, lengths) = (
        smallest_angles(&mesh.vertices, &mesh.faces),
        edge_lengths(&mesh.vertices, &mesh.faces),
    );
    let mean = lengths.iter().sum::<f32>() / lengths.len() as f32;
    let (short, long) = (lengths[0] / mean, lengths[lengths.len() - 1] / mean);
    let ratios = area_ratios(garment);
    let of = |share: f32| ratios[(share * (ratios.len() - 1) as f32) as usize];
    eprintln!(
        "{name}: {} vertices, edges {:.1} mm x {short:.2} to {long:.2}, angles from {:.1} (1 %: {:.1}), \
         pattern areas {:.2} to {:.2} (1 to 99 %: {:.2} to {:.2})",
        mesh.vertices.len(),
        mean * 1e3,
        angles[0],
        angles[angles.len() / 100],
        of(0.0),
        of(1.0),
        of(0.01),
        of(0.99),
    );
    assert!(
        short > 0.4 && long < 1.9,
        "{name}: edges {short} to {long} of their mean"
    );
    assert!(
        angles[0] > 20.0 && angles[angles.len() / 100] > 28.0,
        "{name}: {}",
        angles[0]
    );
    assert!(
        of(0.0) > 0.5 && of(1.0) < 1.6 && of(0.01) > 0.85 && of(0.99) < 1.15,
        "{name}: pattern"
    );
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

#[test]
fn shirts_fit() {
    for (name, character) in characters() {
        let shirt = TShirt::default().make(&character).unwrap();
        assert_sound(&format!("shirt on {name}"), &shirt, 4);
        // A larger body has more edges of the same length.
        let most = if name == "built-in" { 4000 } else { 4500 };
        let count = shirt.mesh.vertices.len();
        assert!((3000..=most).contains(&count), "{name}: {count}");
        assert_mirror_symmetric(&shirt.mesh.vertices, &shirt.mesh.faces);
        let depth = depth(&character, &shirt);
        eprintln!("shirt on {name}: deepest {:.1} mm", depth * 1e3);
        assert!(depth < 0.002);
        for part in ["front", "back", "sleeve_left", "sleeve_right"] {
            assert!(shirt.part(part).is_some());
        }
        let left = shirt.vertices_of(shirt.part("sleeve_left").unwrap()).count();
        let right = shirt.vertices_of(shirt.part("sleeve_right").unwrap()).count();
        assert_eq!(left, right);
    }
}

#[test]
fn skirts_fit() {
    for (name, character) in characters() {
        let skirt = FlaredSkirt::default().make(&character).unwrap();
        assert_sound(&format!("skirt on {name}"), &skirt, 2);
        assert!((3000..=5000).contains(&skirt.mesh.vertices.len()));
        let depth = depth(&character, &skirt);
        eprintln!("skirt on {name}: deepest {:.1} mm", depth * 1e3);
        assert!(depth < 0.002);
        let held = skirt.attached();
        let top = skirt.mesh.vertices.iter().map(|v| v.y).fold(0.0, f32::max);
        for (v, held) in skirt.mesh.vertices.iter().zip(held) {
            assert_eq!(held, v.y > top - 0.04, "held at {v}");
        }
    }
}

#[test]
fn ease_is_as_requested_and_bad_parameters_are_refused() {
    let character = human(&HumanParameters::default()).unwrap();
    let wide = TShirt {
        ease_m: 0.05,
        ..Default::default()
    };
    let wide = wide.make(&character).unwrap();
    let close = TShirt::default().make(&character).unwrap();
    let body = Surface::build(&character.body);
    let mean = |garment: &GarmentMesh| {
        let hits = garment.mesh.vertices.iter().filter_map(|&v| body.closest(v));
        hits.map(|hit| hit.signed_distance).sum::<f32>() / garment.mesh.vertices.len() as f32
    };
    let gain = mean(&wide) - mean(&close);
    assert!((0.018..0.03).contains(&gain), "{gain}");
    let refused = FlaredSkirt {
        flare: f32::NAN,
        ..Default::default()
    };
    let refused = refused.make(&character);
    assert!(matches!(
        refused,
        Err(GarmentError::Parameter { name: "flare", .. })
    ));
}
