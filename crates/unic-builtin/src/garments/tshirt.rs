//! A fitted T-shirt.

mod surface;

use super::{
    BodyShape, Fabric, GarmentError, GarmentMesh, Measurements, Part, Side, check_range, flatten::pattern,
};
use crate::implicit::{
    Field, Lattice, Mirrored, Patch, PositiveSide, Sizing, Surfaces, mirrored, polygonise, remesh,
};
use glam::Vec3;
use std::ops::Range;
use surface::{ShirtSurface, Shoulder};
use unic_core::{character::Character, mesh::TriMesh};

/// A mirror-symmetric T-shirt with set-in sleeves and a round neck.
///
/// Its surface is an offset of the body that is convex around trunk and arms. It is cut at hem,
/// neck and sleeves and along its seams.
///
/// Parts: `back`, `front`, `sleeve_left`, `sleeve_right`. There are no attachments: the shoulders
/// carry it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TShirt {
    /// Distance from the body, metres, 0.005 to 0.06.
    pub ease_m: f32,
    /// Length of the sleeve from the shoulder joint along the arm, metres, 0.12 to 0.26.
    pub sleeve_m: f32,
    /// Height of the hem above the crotch, metres, −0.05 to 0.25.
    pub hem_m: f32,
    /// Distance between the neck and the opening on either side, metres, 0.01 to 0.07.
    pub neck_m: f32,
    /// Length of edges, metres, 0.006 to 0.04; 0.016 gives three to four thousand vertices.
    pub edge_m: f32,
}

impl Default for TShirt {
    fn default() -> Self {
        Self {
            ease_m: 0.024,
            sleeve_m: 0.19,
            hem_m: 0.09,
            neck_m: 0.026,
            edge_m: 0.0165,
        }
    }
}

/// Indices of the cuts in [`Surfaces::cuts`].
const MIDPLANE: usize = 0;
const HEM: usize = 1;
const NECK: usize = 2;
const SIDE_SEAM: usize = 3;
const ARMHOLE: usize = 4;
const SLEEVE_END: usize = 5;

/// Panels of the left half: back and front, and the same plus [`SLEEVE`] on the sleeve.
const BACK: u8 = 0;
const FRONT: u8 = 1;
const SLEEVE: u8 = 2;

/// Added to the label of a left sleeve panel to get that of the right one.
const RIGHT: u8 = 2;

impl TShirt {
    /// Makes the shirt for a character, in its bind-pose space.
    ///
    /// # Errors
    /// [`GarmentError::Parameter`] for a parameter out of range; other errors for a character that
    /// is not of SMPL's kind.
    pub fn make(&self, character: &Character) -> Result<GarmentMesh, GarmentError> {
        self.check()?;
        let body = BodyShape::new(character)?;
        let measures = body.measurements()?;
        let half = self.half(character, &body, &measures)?;
        // Back and front continue over the midplane; the right sleeve has panels of its own.
        let mirror_label = |label| if label < SLEEVE { label } else { label + RIGHT };
        let Mirrored { patch, .. } = mirrored(&half, MIDPLANE, mirror_label);
        let arm = body.on_arm(Side::Left, 0.0).axis;
        let uvs = pattern(&patch.vertices, &patch.faces, &patch.labels, |label| {
            frame(label, arm)
        });
        Ok(with_parts(patch, uvs)?)
    }

    fn check(&self) -> Result<(), GarmentError> {
        check_range("ease_m", self.ease_m, 0.005..=0.06, "0.005 to 0.06 m")?;
        check_range("sleeve_m", self.sleeve_m, 0.12..=0.26, "0.12 to 0.26 m")?;
        check_range("hem_m", self.hem_m, -0.05..=0.25, "-0.05 to 0.25 m")?;
        check_range("neck_m", self.neck_m, 0.01..=0.07, "0.01 to 0.07 m")?;
        check_range("edge_m", self.edge_m, 0.006..=0.04, "0.006 to 0.04 m")
    }

    /// Mesh of the left half with its panels.
    fn half(
        &self,
        character: &Character,
        body: &BodyShape,
        measures: &Measurements,
    ) -> Result<Patch, GarmentError> {
        let hem = measures.crotch + self.hem_m;
        let shirt = ShirtSurface::new(character, body, hem, self.ease_m)?;
        let shoulder = Shoulder::new(body, self.ease_m)?;
        let neck = surface::NeckOpening::new(body, measures, self.neck_m)?;
        let surface = |p: Vec3| shirt.distance(p);
        let (seam_z, sleeve) = (shoulder.joint.z, self.sleeve_m);
        let midplane = |p: Vec3| -p.x;
        let below_hem = |p: Vec3| hem - p.y;
        let in_neck = |p: Vec3| neck.inside(p);
        let in_front = |p: Vec3| p.z - seam_z;
        let in_sleeve = |p: Vec3| shoulder.beyond_armhole(p);
        let beyond_sleeve = |p: Vec3| shoulder.along(p) - sleeve;
        let surfaces = Surfaces {
            surface: &surface,
            cuts: vec![
                &midplane,
                &below_hem,
                &in_neck,
                &in_front,
                &in_sleeve,
                &beyond_sleeve,
            ],
        };
        let mut patch = self.polygonised(&surface, &shoulder, hem..neck.top);
        cut_panels(&mut patch, &surfaces);
        let sizing = Sizing {
            edge: &|_| self.edge_m,
            rounds: 8,
        };
        remesh(&mut patch, &surfaces, sizing);
        Ok(patch)
    }

    /// Mesh of somewhat more than the left half: from below the hem to above the neck and beyond
    /// the sleeve.
    fn polygonised(&self, surface: &Field, shoulder: &Shoulder, heights: Range<f32>) -> Patch {
        // Finer than the wanted edges: remeshing starts with collapses.
        let step = 0.7 * self.edge_m;
        let reach = shoulder.joint + shoulder.arm * (self.sleeve_m + 0.15);
        let lattice = Lattice {
            origin: Vec3::new(-3.0 * step, heights.start - 3.0 * step, shoulder.joint.z - 0.35),
            end: Vec3::new(reach.x + 0.05, heights.end + 2.0 * step, shoulder.joint.z + 0.35),
            step,
        };
        let (vertices, faces) = polygonise(surface, lattice);
        Patch::new(vertices, faces)
    }
}

/// Cuts out the left half and labels its panels.
fn cut_panels(patch: &mut Patch, surfaces: &Surfaces) {
    // Every cut names the panels that exist by then. The hem must not cut the sleeves, nor their
    // ends the trunk: a field may change sign there too.
    patch.cut(surfaces, MIDPLANE, &[BACK], PositiveSide::Remove);
    patch.cut(surfaces, NECK, &[BACK], PositiveSide::Remove);
    patch.cut(surfaces, SIDE_SEAM, &[BACK], PositiveSide::Label(FRONT));
    patch.cut(surfaces, ARMHOLE, &[BACK, FRONT], PositiveSide::Label(SLEEVE));
    patch.cut(surfaces, HEM, &[BACK, FRONT], PositiveSide::Remove);
    patch.cut(
        surfaces,
        SLEEVE_END,
        &[SLEEVE, SLEEVE + FRONT],
        PositiveSide::Remove,
    );
}

/// Directions of u and v of a panel seen from outside; v runs up the trunk and along a sleeve
/// towards the hand.
fn frame(label: u8, left_arm: Vec3) -> [Vec3; 2] {
    let v = match label {
        BACK | FRONT => Vec3::Y,
        2 | 3 => Vec3::new(left_arm.x, left_arm.y, 0.0).normalize_or(Vec3::X),
        _ => Vec3::new(-left_arm.x, left_arm.y, 0.0).normalize_or(Vec3::NEG_X),
    };
    let outward = if label % 2 == FRONT { Vec3::Z } else { Vec3::NEG_Z };
    [v.cross(outward), v]
}

/// Garment of the mesh of both halves. Both panels of a sleeve form one part.
fn with_parts(patch: Patch, uvs: unic_core::mesh::Uvs) -> Result<GarmentMesh, unic_core::mesh::MeshError> {
    let part_of = |label: u8| u32::from(if label < SLEEVE { label } else { label / 2 + 1 });
    let mut part_of_vertex = vec![u32::MAX; patch.vertices.len()];
    for (face, &label) in patch.faces.iter().zip(&patch.labels) {
        for &v in face {
            let part = &mut part_of_vertex[v as usize];
            // A vertex on a seam belongs to the part with the lower index.
            *part = (*part).min(part_of(label));
        }
    }
    let names = ["back", "front", "sleeve_left", "sleeve_right"];
    let mut mesh = TriMesh::new(patch.vertices, patch.faces)?;
    mesh.uvs = Some(uvs);
    Ok(GarmentMesh {
        mesh,
        parts: names
            .map(|name| Part {
                name: name.to_owned(),
                fabric: Fabric::Cotton,
            })
            .to_vec(),
        part_of_vertex,
        attachments: Vec::new(),
    })
}
