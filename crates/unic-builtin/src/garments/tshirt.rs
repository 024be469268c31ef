//! A fitted T-shirt.

mod surface;

use super::{
    BodyShape, Fabric, GarmentError, GarmentMesh, Measurements, Part, Side, check_range, flatten::pattern,
};
use crate::implicit::{Beyond, Field, Lattice, Patch, Sizing, Surfaces, mirrored, polygonise, remesh};
use glam::Vec3;
use std::ops::Range;
use surface::{ShirtSurface, Shoulder};
use unic_core::{character::Character, mesh::TriMesh};

/// A T-shirt with set-in sleeves and a round neck, mirror-symmetric: an offset of the body, convex
/// around trunk and arms, cut at hem, neck and sleeves and along its seams.
///
/// Parts: `back`, `front`, `sleeve_left`, `sleeve_right`. Nothing is attached: it hangs from the
/// shoulders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TShirt {
    /// Distance from the body, metres, 0.005 to 0.06.
    pub ease_m: f32,
    /// Sleeve from the shoulder joint along the arm, metres, 0.12 to 0.26.
    pub sleeve_m: f32,
    /// Height of the hem above the crotch, metres, −0.05 to 0.25.
    pub hem_m: f32,
    /// How much wider than the neck the opening is on either side, metres, 0.01 to 0.07.
    pub neck_m: f32,
    /// Length of edges, metres, 0.006 to 0.04; 0.016 gives 3-4 thousand vertices.
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

/// Cuts, by their index in [`Surfaces::cuts`].
const MIDPLANE: usize = 0;
const HEM: usize = 1;
const NECK: usize = 2;
const SIDE_SEAM: usize = 3;
const ARMHOLE: usize = 4;
const SLEEVE_END: usize = 5;

/// Panels of the left half: front and back of trunk and sleeve.
const BACK: u8 = 0;
const FRONT: u8 = 1;
const SLEEVE: u8 = 2;

impl TShirt {
    /// The shirt on a character, in its bind-pose space.
    ///
    /// # Errors
    /// Parameters out of range, a character that is not SMPL's kind.
    pub fn make(&self, character: &Character) -> Result<GarmentMesh, GarmentError> {
        self.check()?;
        let body = BodyShape::new(character)?;
        let measures = body.measurements()?;
        let half = self.half(character, &body, &measures)?;
        let (whole, _) = mirrored(
            &half,
            MIDPLANE,
            |label| if label < SLEEVE { label } else { label + 2 },
        );
        let (_, arm) = body.on_arm(Side::Left, 0.0);
        let uvs = pattern(&whole.vertices, &whole.faces, &whole.labels, |label| {
            frame(label, arm)
        });
        Ok(sewn(whole, uvs)?)
    }

    fn check(&self) -> Result<(), GarmentError> {
        check_range("ease_m", self.ease_m, 0.005..=0.06, "0.005 to 0.06 m")?;
        check_range("sleeve_m", self.sleeve_m, 0.12..=0.26, "0.12 to 0.26 m")?;
        check_range("hem_m", self.hem_m, -0.05..=0.25, "-0.05 to 0.25 m")?;
        check_range("neck_m", self.neck_m, 0.01..=0.07, "0.01 to 0.07 m")?;
        check_range("edge_m", self.edge_m, 0.006..=0.04, "0.006 to 0.04 m")
    }

    /// The left half with its panels.
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

    /// More than the left half, from below the hem to above the neck and beyond the sleeve.
    fn polygonised(&self, surface: &Field, shoulder: &Shoulder, heights: Range<f32>) -> Patch {
        // Smaller than the edges wanted: remeshing goes down to them.
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

/// Cuts the left half out and tells its panels apart.
fn cut_panels(patch: &mut Patch, surfaces: &Surfaces) {
    patch.cut(surfaces, MIDPLANE, &[BACK], Beyond::Remove);
    patch.cut(surfaces, NECK, &[BACK], Beyond::Remove);
    patch.cut(surfaces, SIDE_SEAM, &[BACK], Beyond::Label(FRONT));
    patch.cut(surfaces, ARMHOLE, &[BACK, FRONT], Beyond::Label(SLEEVE));
    patch.cut(surfaces, HEM, &[BACK, FRONT], Beyond::Remove);
    patch.cut(surfaces, SLEEVE_END, &[SLEEVE, SLEEVE + FRONT], Beyond::Remove);
}

/// Directions of u and v of a panel seen from outside; v is along the trunk upward, along a sleeve
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

/// The garment of a whole patch: both panels of a sleeve are one part.
fn sewn(whole: Patch, uvs: unic_core::mesh::Uvs) -> Result<GarmentMesh, unic_core::mesh::MeshError> {
    let part_of = |label: u8| u32::from(if label < SLEEVE { label } else { label / 2 + 1 });
    let mut part_of_vertex = vec![u32::MAX; whole.vertices.len()];
    for (face, &label) in whole.faces.iter().zip(&whole.labels) {
        for &v in face {
            let part = &mut part_of_vertex[v as usize];
            *part = (*part).min(part_of(label));
        }
    }
    let names = ["back", "front", "sleeve_left", "sleeve_right"];
    let mut mesh = TriMesh::new(whole.vertices, whole.faces)?;
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
