//! Wrinkles of a garment in rest space: what a smoothing removes from its displacements.

use super::{smoothing::Smoothing, welded::WeldedMesh};
use crate::error::Result;
use faer::Mat;
use glam::Vec3;
use unic_core::{character::Garment, mesh::vertex_normals};

/// Filter from displacements of a garment's V vertices to its wrinkles.
///
/// The height of a displacement is its part along the normal of a rest shape that is smoothed twice
/// by a wavelength. Wrinkles are the heights minus the heights smoothed once by the same wavelength:
/// they hold what is shorter. They are linear in the displacements.
pub struct WrinkleFilter {
    smoothing: Smoothing,
    /// Garment vertex of each welded vertex.
    vertices: Vec<u32>,
    /// Welded vertex of each garment vertex, or none for a vertex without a face.
    welded: Vec<Option<u32>>,
    /// Unit normal of the smoothed rest shape at each garment vertex; zero for a vertex without a
    /// face.
    normals: Vec<Vec3>,
    /// Share of the prediction that each garment vertex gets, 0 to 1.
    shares: Vec<f32>,
}

impl WrinkleFilter {
    /// Prepares the wrinkles of a garment below a wavelength, metres.
    ///
    /// # Errors
    /// A rest mesh whose smoothing cannot be factorised.
    pub fn new(garment: &Garment, wavelength_m: f64) -> Result<Self> {
        let mesh = WeldedMesh::new(&garment.rest);
        let smoothing = Smoothing::new(&mesh, wavelength_m)?;
        let welded = mesh.indices(&garment.rest);
        // Along a pleat's own normals, which lean to both sides, every shift would be a wrinkle.
        // Smoothed once, they still lean a little.
        let smooth = smoothing.smoothed(&smoothing.smoothed(&mesh.rest.vertices));
        let mut of_welded = Vec::new();
        vertex_normals(&smooth, &mesh.rest.faces, &mut of_welded);
        let normal = |w: &Option<u32>| w.map_or(Vec3::ZERO, |w| of_welded[w as usize]);
        Ok(Self {
            smoothing,
            normals: welded.iter().map(normal).collect(),
            shares: (0..welded.len()).map(|v| garment.share(v)).collect(),
            welded,
            vertices: mesh.vertices,
        })
    }

    /// Unit normals of the smoothed rest shape, V vectors; zero at vertices without faces.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Returns the heights of V displacements in rest space, in their unit.
    pub fn heights<'a>(&'a self, displacements: &'a [Vec3]) -> impl Iterator<Item = f32> + 'a {
        displacements.iter().zip(&self.normals).map(|(u, n)| u.dot(*n))
    }

    /// Returns the wrinkles of several fields of V displacements in rest space, in their unit: V
    /// numbers a field, field after field. The displacements include the garment's mask. A vertex
    /// that the mask fixes has no wrinkles, and the smoothing counts by the vertex's share.
    pub fn wrinkles(&self, fields: &[Vec<Vec3>]) -> Vec<f32> {
        let heights: Vec<Vec<f32>> = fields.iter().map(|u| self.heights(u).collect()).collect();
        let height = |i: usize, field: usize| f64::from(heights[field][self.vertices[i] as usize]);
        let rough = Mat::from_fn(self.vertices.len(), fields.len(), height);
        let smooth = self.smoothing.smooth(&rough);
        let wrinkle = |field: usize, (welded, share): (&Option<u32>, &f32)| {
            welded.map_or(0.0, |w| {
                let at = (w as usize, field);
                (rough[at] - f64::from(*share) * smooth[at]) as f32
            })
        };
        let vertices = || self.welded.iter().zip(&self.shares);
        (0..fields.len())
            .flat_map(|field| vertices().map(move |v| (field, v)))
            .map(|(field, v)| wrinkle(field, v))
            .collect()
    }
}
