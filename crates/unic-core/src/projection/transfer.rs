//! Transfer of strain limits to another mesh of the garment.

use super::{
    StrainLimit, StrainProjection,
    levels::{Level, LevelTopology, Levels},
    welded_edges, welded_faces,
};
use crate::{
    mesh::TriMesh,
    surface_map::{SurfaceMap, SurfaceMapError},
    topology::weld,
};
use glam::Vec3;

impl StrainProjection {
    /// Returns limits for the [`limited_pairs`] of another mesh of the garment.
    ///
    /// `map` leads from this garment's rest shape to the vertices of `mesh`. Limits are transferred
    /// as strains: means over the edges at each vertex, interpolated at the ends of each new edge,
    /// and means over the chords at the nearest samples of a level with about as many. The mesh of
    /// the garment itself keeps the limits as they are.
    ///
    /// # Errors
    /// A map to another mesh, from one with another number of vertices.
    pub(crate) fn limits_on_mesh(
        &self,
        rest: &TriMesh,
        mesh: &TriMesh,
        map: &SurfaceMap,
    ) -> Result<Vec<StrainLimit>, SurfaceMapError> {
        // Means would differ from the limits of the single pairs.
        if mesh.vertices == rest.vertices && mesh.faces == rest.faces {
            return Ok(self.limits.clone());
        }
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
        let mut limits: Vec<StrainLimit> = welded_edges(mesh).iter().map(limit).collect();
        if let Some(levels) = &self.levels {
            limits.extend(chord_limits(levels, rest, mesh));
        }
        Ok(limits)
    }

    /// Returns for each vertex the mean of a limit over the edges at its place, divided by their
    /// rest lengths. It is 1 for vertices without edges.
    fn vertex_stretch(&self, rest: &TriMesh, length: impl Fn(&StrainLimit) -> f32) -> Vec<f32> {
        let mut sums = vec![(0.0f32, 0.0f32); rest.vertices.len()];
        for (&[a, b], limit) in welded_edges(rest).iter().zip(&self.limits) {
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

/// Greatest length of a chord of a garment without levels, by its rest length: no limit in effect.
const LOOSE: f32 = 10.0;

/// Returns limits for the chords of another mesh of the garment.
fn chord_limits(levels: &Levels, rest: &TriMesh, mesh: &TriMesh) -> Vec<StrainLimit> {
    let first_at_place = weld(&mesh.vertices);
    let faces = welded_faces(mesh, &first_at_place);
    let topology = LevelTopology::new(mesh, &faces, &first_at_place);
    let limits = topology.levels().flat_map(|(count, chords)| {
        // As a share of the larger number, so that 100 is as far from 50 as from 200.
        let far = |l: &&Level| l.samples().max(count) as f32 / l.samples().min(count).max(1) as f32;
        let nearest = levels.levels().iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        let known = nearest.map(|level| sample_stretch(levels, level, rest));
        chords.map(move |chord| {
            let [a, b] = chord.map(|v| mesh.vertices[v as usize]);
            match &known {
                Some(known) => limit_between(known, a, b),
                None => StrainLimit {
                    shortest: 0.0,
                    longest: (LOOSE * a.distance(b)).max(f32::MIN_POSITIVE),
                },
            }
        })
    });
    limits.collect()
}

/// Stretch at the samples of a level: rest positions, and the least and greatest length of the
/// chords there divided by their rest lengths.
type SampleStretch = Vec<(Vec3, [f32; 2])>;

fn sample_stretch(levels: &Levels, level: &Level, rest: &TriMesh) -> SampleStretch {
    let at = |place: u32| rest.vertices[levels.samples()[place as usize] as usize];
    let mut sums = vec![[0.0f32; 3]; level.samples()];
    for chord in level.chord_colours().flatten() {
        let length = at(chord.ends[0]).distance(at(chord.ends[1]));
        for end in chord.ends {
            let [shortest, longest, lengths] = &mut sums[end as usize];
            *shortest += chord.limit.shortest;
            *longest += chord.limit.longest;
            *lengths += length;
        }
    }
    let stretch = |(place, [shortest, longest, length]): (u32, [f32; 3])| match length > 0.0 {
        true => (at(place), [shortest / length, longest / length]),
        false => (at(place), [0.0, 1.0]),
    };
    (0..).zip(sums).map(stretch).collect()
}

fn limit_between(known: &SampleStretch, a: Vec3, b: Vec3) -> StrainLimit {
    let near = |p: Vec3| {
        let squared = |s: &&(Vec3, [f32; 2])| s.0.distance_squared(p);
        let nearest = known.iter().min_by(|x, y| squared(x).total_cmp(&squared(y)));
        nearest.map_or([0.0, 1.0], |s| s.1)
    };
    let (a_stretch, b_stretch) = (near(a), near(b));
    let half_length = 0.5 * a.distance(b);
    let longest = (half_length * (a_stretch[1] + b_stretch[1])).max(f32::MIN_POSITIVE);
    StrainLimit {
        shortest: (half_length * (a_stretch[0] + b_stretch[0])).min(longest),
        longest,
    }
}
