//! Construction of a [`Cloth`] from its description.

use super::{Cloth, ClothError, ClothSpec, hinges::hinges, order::ParticleOrder};
use crate::{
    Material,
    constraint::{
        ColouredConstraints,
        bend::BendConstraint,
        stretch::{InPlane, StretchConstraint},
    },
    long_range::LongRangeLimits,
};
use glam::{Mat2, Vec3};
use unic_core::mesh::{TriMesh, Uvs};

/// A triangle between particles.
struct ClothFace {
    particles: [u32; 3],
    material: Material,
    /// Direction of the warp in rest space; not normalised, and not always in the face's plane.
    warp: Vec3,
}

/// Masses in kilograms.
struct Masses {
    particles: Vec<f32>,
    faces: Vec<f32>,
}

/// Faces around each particle, in compressed rows: those of particle i are
/// `faces[starts[i]..starts[i + 1]]`.
struct FacesOfParticles {
    starts: Vec<u32>,
    faces: Vec<u32>,
}

pub(super) fn cloth(spec: &ClothSpec) -> Result<Cloth, ClothError> {
    check(spec)?;
    let order = ParticleOrder::new(&spec.rest.vertices, &spec.rest.faces);
    let (particle_of_vertex, positions) = (order.particle_of_vertex, order.positions);
    let faces = faces(spec, &particle_of_vertex);
    if faces.is_empty() {
        return Err(ClothError::Empty);
    }
    let triangles: Vec<[u32; 3]> = faces.iter().map(|f| f.particles).collect();
    let stretch: Vec<StretchConstraint> = faces.iter().map(|f| stretch(f, &positions)).collect();
    let masses = masses(&faces, &stretch, positions.len());
    let mut inverse_masses: Vec<f32> = masses.particles.iter().map(|m| m.recip()).collect();
    let of_vertex = |v: u32| particle_of_vertex[v as usize];
    let pins: Vec<u32> = spec.pins.iter().map(|&v| of_vertex(v)).collect();
    pins.iter().for_each(|&p| inverse_masses[p as usize] = 0.0);
    let mut attachments = spec.attachments.clone();
    attachments
        .iter_mut()
        .for_each(|a| a.vertex = of_vertex(a.vertex));
    // The sort is stable: of several attachments to one particle the first in the list stays.
    attachments.sort_by_key(|a| a.vertex);
    attachments.dedup_by_key(|a| a.vertex);
    let is_held: Vec<bool> = (0..positions.len() as u32)
        .map(|p| {
            inverse_masses[p as usize] == 0.0 || attachments.binary_search_by_key(&p, |a| a.vertex).is_ok()
        })
        .collect();
    let bends = bends(&faces, &triangles, &positions, spec.rest_angle_share);
    let rest = TriMesh {
        vertices: positions,
        faces: triangles,
        uvs: None,
    };
    let around = faces_of_particles(rest.vertices.len(), &rest.faces);
    Ok(Cloth {
        particle_of_vertex,
        stretch: ColouredConstraints::new(&stretch, &inverse_masses),
        bend: ColouredConstraints::new(&bends, &inverse_masses),
        long_range: LongRangeLimits::build(&rest, &masses.particles, &is_held),
        material: widest_material(spec, &faces, &stretch),
        rest,
        face_masses: masses.faces,
        masses: masses.particles,
        inverse_masses,
        face_starts: around.starts,
        faces_of_particles: around.faces,
        attachments,
        pins,
    })
}

fn check(spec: &ClothSpec) -> Result<(), ClothError> {
    let (mesh, materials) = (&spec.rest, spec.materials.len());
    mesh.check()?;
    for (material, values) in spec.materials.iter().enumerate() {
        if let Some((quantity, found)) = values.first_invalid() {
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
    let is_valid = |face: &[u32; 3]| face.iter().all(|&t| (t as usize) < uvs.coordinates.len());
    let invalid = (0..faces).find(|&face| !uvs.faces.get(face).is_some_and(is_valid));
    invalid.map_or(Ok(()), |face| Err(ClothError::Uvs { face }))
}

/// Lists the triangles with three different particles, sorted, each rotated to begin with its
/// lowest particle.
fn faces(spec: &ClothSpec, particle_of_vertex: &[u32]) -> Vec<ClothFace> {
    let face = |(index, corners): (usize, &[u32; 3])| {
        let particles = corners.map(|v| particle_of_vertex[v as usize]);
        let [a, b, c] = particles;
        let material = spec.face_materials.get(index).copied().unwrap_or(0);
        (a != b && b != c && c != a).then(|| ClothFace {
            particles: lowest_first(particles),
            material: spec.materials[usize::from(material)],
            warp: warp(spec, index),
        })
    };
    let all = spec.rest.faces.iter().enumerate();
    let mut faces: Vec<ClothFace> = all.filter_map(face).collect();
    // Together with the order of particles this makes the result independent of the numbering of
    // the input mesh.
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

/// Returns the direction of the warp in a face: that of growing v if its UVs are not degenerate,
/// else the vertical, or +Z in a nearly horizontal face.
fn warp(spec: &ClothSpec, face: usize) -> Vec3 {
    let [a, b, c] = spec.rest.faces[face].map(|v| spec.rest.vertices[v as usize]);
    let (ab, ac) = (b - a, c - a);
    let along_v = spec.rest.uvs.as_ref().and_then(|uvs| {
        let [p, q, r] = uvs.faces[face].map(|t| uvs.coordinates[t as usize]);
        let uv_edges = Mat2::from_cols(q - p, r - p);
        // The determinant is relative to the edge lengths, since UVs have any scale. Below this
        // sine of the corner angle the inverse is rounding noise.
        let is_regular = uv_edges.determinant().abs() > 1e-6 * (q - p).length() * (r - p).length();
        let inverse = is_regular.then(|| uv_edges.inverse())?;
        let along = ab * inverse.y_axis.x + ac * inverse.y_axis.y;
        along.is_finite().then_some(along)
    });
    along_v.unwrap_or_else(|| {
        // The vertical has no useful projection into a nearly horizontal face.
        let normal_y = ab.cross(ac).normalize_or_zero().y.abs();
        if normal_y > 0.95 { Vec3::Z } else { Vec3::Y }
    })
}

fn stretch(face: &ClothFace, positions: &[Vec3]) -> StretchConstraint {
    let m = &face.material;
    let corners = face.particles.map(|p| positions[p as usize]);
    let stiffness = InPlane {
        weft: m.weft_stiffness,
        warp: m.warp_stiffness,
        shear: m.shear_stiffness,
    };
    StretchConstraint::new(face.particles, corners, face.warp, stiffness)
}

/// Computes the masses of `count` particles and of all faces.
fn masses(faces: &[ClothFace], stretch: &[StretchConstraint], count: usize) -> Masses {
    // Summed in f64, so that the rounding error does not grow with the number of faces.
    let mut masses = vec![0.0f64; count];
    let mut face_masses = Vec::with_capacity(faces.len());
    for (face, shape) in faces.iter().zip(stretch) {
        let mass = face.material.area_density * shape.area;
        let third = f64::from(mass) / 3.0;
        face.particles.iter().for_each(|&p| masses[p as usize] += third);
        face_masses.push(mass);
    }
    Masses {
        particles: masses.into_iter().map(|m| m as f32).collect(),
        faces: face_masses,
    }
}

/// Makes a bending constraint for each hinge, with the mean of its two materials.
fn bends(
    faces: &[ClothFace],
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    rest_angle_share: f32,
) -> Vec<BendConstraint> {
    let material_at = |a: u32, b: u32, third: u32| {
        let mut corners = [a, b, third];
        corners.sort_unstable();
        // Faces are sorted by their lowest corner, so that the search starts with the first face
        // that has it.
        let from = triangles.partition_point(|t| t[0] < corners[0]);
        let has_corners = |f: &&ClothFace| {
            let mut other = f.particles;
            other.sort_unstable();
            other == corners
        };
        faces[from..]
            .iter()
            .find(has_corners)
            .map_or(faces[0].material, |f| f.material)
    };
    let bend = |particles: [u32; 4]| {
        let [a, b, left, right] = particles;
        let sides = [material_at(a, b, left), material_at(a, b, right)];
        let mean = |of: fn(&Material) -> f32| 0.5 * (of(&sides[0]) + of(&sides[1]));
        let (stiffness, damping) = (mean(|m| m.bending_stiffness), mean(|m| m.bending_damping_s));
        let corners = particles.map(|p| positions[p as usize]);
        BendConstraint::new(particles, corners, rest_angle_share, stiffness, damping)
    };
    hinges(triangles).into_iter().filter_map(bend).collect()
}

fn faces_of_particles(count: usize, faces: &[[u32; 3]]) -> FacesOfParticles {
    let mut pairs: Vec<(u32, u32)> = (faces.iter().enumerate())
        .flat_map(|(face, corners)| corners.map(|p| (p, face as u32)))
        .collect();
    pairs.sort_unstable();
    let starts = (0..=count as u32)
        .map(|p| pairs.partition_point(|&(at, _)| at < p) as u32)
        .collect();
    FacesOfParticles {
        starts,
        faces: pairs.into_iter().map(|(_, face)| face).collect(),
    }
}

/// Returns the material that covers the largest area.
fn widest_material(spec: &ClothSpec, faces: &[ClothFace], stretch: &[StretchConstraint]) -> Material {
    let area = |material: &Material| -> f32 {
        let same = faces.iter().zip(stretch).filter(|(f, _)| f.material == *material);
        same.map(|(_, s)| s.area).sum()
    };
    let by_area = |a: &&Material, b: &&Material| area(a).total_cmp(&area(b));
    spec.materials
        .iter()
        .max_by(by_area)
        .copied()
        .unwrap_or(Material::COTTON)
}
