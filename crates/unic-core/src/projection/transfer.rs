//! Transfer of strain limits to another mesh of the garment.

use super::{StrainLimit, StrainProjection, limited_edges};
use crate::{
    mesh::TriMesh,
    surface_map::{SurfaceMap, SurfaceMapError},
};

impl StrainProjection {
    /// Returns limits for the [`limited_edges`] of another mesh of the garment.
    ///
    /// `map` leads from this garment's rest shape to the vertices of `mesh`. Limits are transferred
    /// as strains: means over the edges at each vertex, interpolated at the ends of each new edge.
    ///
    /// # Errors
    /// A map from a mesh with another number of vertices.
    pub(crate) fn limits_on_mesh(
        &self,
        rest: &TriMesh,
        mesh: &TriMesh,
        map: &SurfaceMap,
    ) -> Result<Vec<StrainLimit>, SurfaceMapError> {
        let shortest = map.interpolate_scalars(&self.vertex_stretch(rest, |l| l.shortest))?;
        let longest = map.interpolate_scalars(&self.vertex_stretch(rest, |l| l.longest))?;
        let limit = |&[a, b]: &[u32; 2]| {
            let (a, b) = (a as usize, b as usize);
            let half_length = 0.5 * mesh.vertices[a].distance(mesh.vertices[b]);
            let longest = half_length * (longest[a] + longest[b]);
            StrainLimit {
                shortest: (half_length * (shortest[a] + shortest[b])).min(longest),
                // An edge between vertices at almost one place keeps a usable limit.
                longest: longest.max(f32::MIN_POSITIVE),
            }
        };
        Ok(limited_edges(mesh).iter().map(limit).collect())
    }

    /// Returns for each vertex the mean of a limit over the edges at its place, divided by their
    /// rest lengths. It is 1 for vertices without edges.
    fn vertex_stretch(&self, rest: &TriMesh, length: impl Fn(&StrainLimit) -> f32) -> Vec<f32> {
        let mut sums = vec![(0.0f32, 0.0f32); rest.vertices.len()];
        for (&[a, b], limit) in limited_edges(rest).iter().zip(&self.limits) {
            let rest_length = rest.vertices[a as usize].distance(rest.vertices[b as usize]);
            for end in [a, b] {
                let (limits, lengths) = &mut sums[end as usize];
                *limits += length(limit);
                *lengths += rest_length;
            }
        }
        let stretch = |&first: &u32| match sums[first as usize] {
            (limits, lengths) if lengths > 0.0 => limits / lengths,
            _ => 1.0,
        };
        self.first_at_place.iter().map(stretch).collect()
    }
}
