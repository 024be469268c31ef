//! From a description to the arrays of the solver.

use super::{Cloth, ClothError, ClothSpec, hinges::hinges, order};
use crate::{
    Material,
    aggregate::Aggregates,
    constraint::{Coloured, bend::Bend, stretch::Stretch},
};
use glam::{Mat2, Vec3};
use unic_core::mesh::{TriMesh, Uvs};

/// A triangle between particles.
struct Face {
    particles: [u32; 3],
    material: Material,
    /// Direction of the warp in space.
    warp: Vec3,
}

pub(super) fn cloth(spec: &ClothSpec) -> Result<Cloth, ClothError> {
    check(spec)?;
    let (particle_of_vertex, places) = order::particles(&spec.rest.vertices, &spec.rest.faces);
    let faces = faces(spec, &particle_of_vertex);
    if faces.is_empty() {
        return Err(ClothError::Empty);
    }
    let triangles: Vec<[u32; 3]> = faces.iter().map(|f| f.particles).collect();
    let stretch: Vec<Stretch> = faces.iter().map(|f| stretch(f, &places)).collect();
    let (masses, face_masses) = masses(&faces, &stretch, places.len());
    let mut inverse_masses: Vec<f32> = masses.iter().map(|m| m.recip()).collect();
    let of_vertex = |v: u32| particle_of_vertex[v as usize];
    let pins: Vec<(u32, u32)> = spec.pins.iter().map(|&v| (v, of_vertex(v))).collect();
    (pins.iter()).for_each(|&(_, particle)| inverse_masses[particle as usize] = 0.0);
    let mut attachments = spec.attachments.clone();
    attachments
        .iter_mut()
        .for_each(|a| a.vertex = of_vertex(a.vertex));
    attachments.sort_by_key(|a| a.vertex);
    attachments.dedup_by_key(|a| a.vertex);
    let is_held: Vec<bool> = (0..places.len() as u32)
        .map(|p| {
            inverse_masses[p as usize] == 0.0 || attachments.binary_search_by_key(&p, |a| a.vertex).is_ok()
        })
        .collect();
    let bends = bends(&faces, &triangles, &places, spec.rest_angle_share);
    let rest = TriMesh {
        vertices: places,
        faces: triangles,
        uvs: None,
    };
    let (starts, around) = faces_around(rest.vertices.len(), &rest.faces);
    Ok(Cloth {
        particle_of_vertex,
        stretch: Coloured::new(&stretch, &inverse_masses),
        bend: Coloured::new(&bends, &inverse_masses),
        aggregates: Aggregates::build(&rest, &masses, &is_held),
        material: widest_material(spec, &faces, &stretch),
        rest,
        face_masses,
        masses,
        inverse_masses,
        starts,
        around,
        attachments,
        pins,
    })
}

fn check(spec: &ClothSpec) -> Result<(), ClothError> {
    let (mesh, materials) = (&spec.rest, spec.materials.len());
    mesh.check()?;
    for (material, values) in spec.materials.iter().enumerate() {
        if let Some((quantity, found)) = values.first_bad() {
            return Err(ClothError::Material {
                material,
                quantity,
                found,
            });
        }
    }
    let (faces, found) = (mesh.faces.len(), spec.face_materials.len());
    if found != 0 && found != faces {
        return Err(ClothError::FaceMaterials { faces, found });
    }
    let named = |face: usize| usize::from(spec.face_materials.get(face).copied().unwrap_or(0));
    if let Some(face) = (0..faces).find(|&face| named(face) >= materials) {
        return Err(ClothError::NoMaterial {
            face,
            found: named(face),
            materials,
        });
    }
    let held = (spec.pins.iter().copied()).chain(spec.attachments.iter().map(|a| a.vertex));
    let vertices = mesh.vertices.len();
    if let Some(vertex) = held.into_iter().find(|&v| v as usize >= vertices) {
        return Err(ClothError::Vertex { vertex, vertices });
    }
    mesh.uvs.as_ref().map_or(Ok(()), |uvs| check_uvs(uvs, faces))
}

fn check_uvs(uvs: &Uvs, faces: usize) -> Result<(), ClothError> {
    let is_sound = |face: &[u32; 3]| face.iter().all(|&t| (t as usize) < uvs.coordinates.len());
    let bad = (0..faces).find(|&face| !uvs.faces.get(face).is_some_and(is_sound));
    bad.map_or(Ok(()), |face| Err(ClothError::Uvs { face }))
}

/// Triangles with three different particles, the lowest first, sorted.
fn faces(spec: &ClothSpec, particle_of_vertex: &[u32]) -> Vec<Face> {
    let face = |(index, corners): (usize, &[u32; 3])| {
        let particles = corners.map(|v| particle_of_vertex[v as usize]);
        let [a, b, c] = particles;
        let material = spec.face_materials.get(index).copied().unwrap_or(0);
        (a != b && b != c && c != a).then(|| Face {
            particles: lowest_first(particles),
            material: spec.materials[usize::from(material)],
            warp: warp(spec, index),
        })
    };
    let all = spec.rest.faces.iter().enumerate();
    let mut faces: Vec<Face> = all.filter_map(face).collect();
    faces.sort_by_key(|f| f.particles);
    faces
}

fn lowest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Direction of the warp in a face: of growing v where the UVs tell, else the grain.
fn warp(spec: &ClothSpec, face: usize) -> Vec3 {
    let [a, b, c] = spec.rest.faces[face].map(|v| spec.rest.vertices[v as usize]);
    let (ab, ac) = (b - a, c - a);
    let along_v = spec.rest.uvs.as_ref().and_then(|uvs| {
        let [p, q, r] = uvs.faces[face].map(|t| uvs.coordinates[t as usize]);
        let flat = Mat2::from_cols(q - p, r - p);
        let is_flat = flat.determinant().abs() > 1e-6 * (q - p).length() * (r - p).length();
        let inverse = is_flat.then(|| flat.inverse())?;
        let along = ab * inverse.y_axis.x + ac * inverse.y_axis.y;
        along.is_finite().then_some(along)
    });
    along_v.unwrap_or_else(|| {
        let steepness = ab.cross(ac).normalize_or_zero().y.abs();
        if steepness > 0.95 { Vec3::Z } else { Vec3::Y }
    })
}

fn stretch(face: &Face, places: &[Vec3]) -> Stretch {
    let m = &face.material;
    let corners = face.particles.map(|p| places[p as usize]);
    let stiffness = [m.weft_stiffness, m.warp_stiffness, m.shear_stiffness];
    Stretch::new(face.particles, corners, face.warp, stiffness)
}

/// Of particles and of faces, kg. In f64, so that the sums hardly depend on how many there are.
fn masses(faces: &[Face], stretch: &[Stretch], count: usize) -> (Vec<f32>, Vec<f32>) {
    let mut masses = vec![0.0f64; count];
    let mut face_masses = Vec::with_capacity(faces.len());
    for (face, shape) in faces.iter().zip(stretch) {
        let mass = face.material.area_density * shape.area;
        let third = f64::from(mass) / 3.0;
        face.particles.iter().for_each(|&p| masses[p as usize] += third);
        face_masses.push(mass);
    }
    (masses.into_iter().map(|m| m as f32).collect(), face_masses)
}

fn bends(faces: &[Face], triangles: &[[u32; 3]], places: &[Vec3], rest_angle_share: f32) -> Vec<Bend> {
    let material_at = |a: u32, b: u32, third: u32| {
        let mut corners = [a, b, third];
        corners.sort_unstable();
        // Faces are sorted by their lowest corner.
        let from = triangles.partition_point(|t| t[0] < corners[0]);
        let is_it = |f: &&Face| {
            let mut other = f.particles;
            other.sort_unstable();
            other == corners
        };
        faces[from..]
            .iter()
            .find(is_it)
            .map_or(faces[0].material, |f| f.material)
    };
    let bend = |particles: [u32; 4]| {
        let [a, b, left, right] = particles;
        let sides = [material_at(a, b, left), material_at(a, b, right)];
        let mean = |of: fn(&Material) -> f32| 0.5 * (of(&sides[0]) + of(&sides[1]));
        let (stiffness, damping) = (mean(|m| m.bending_stiffness), mean(|m| m.bending_damping_s));
        let corners = particles.map(|p| places[p as usize]);
        Bend::new(particles, corners, rest_angle_share, stiffness, damping)
    };
    hinges(triangles).into_iter().filter_map(bend).collect()
}

fn faces_around(count: usize, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let mut pairs: Vec<(u32, u32)> = (faces.iter().enumerate())
        .flat_map(|(face, corners)| corners.map(|p| (p, face as u32)))
        .collect();
    pairs.sort_unstable();
    let starts = (0..=count as u32)
        .map(|p| pairs.partition_point(|&(at, _)| at < p) as u32)
        .collect();
    (starts, pairs.into_iter().map(|(_, face)| face).collect())
}

fn widest_material(spec: &ClothSpec, faces: &[Face], stretch: &[Stretch]) -> Material {
    let area = |material: &Material| -> f32 {
        let of_it = faces.iter().zip(stretch).filter(|(f, _)| f.material == *material);
        of_it.map(|(_, s)| s.area).sum()
    };
    let by_area = |a: &&Material, b: &&Material| area(a).total_cmp(&area(b));
    spec.materials
        .iter()
        .max_by(by_area)
        .copied()
        .unwrap_or(Material::COTTON)
}
