//! Freedom of vertices in a projection.

/// Share of its moves that each vertex makes, from 0 (fixed) to 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Freedom {
    /// One share for each vertex; none if all move freely, so that their sweeps do not look.
    shares: Option<Vec<f32>>,
}

impl Freedom {
    /// Takes for each vertex the least share of the mask among the vertices at its place. All are
    /// free without a mask.
    pub(super) fn of_mask(mask: Option<&[f32]>, first_at_place: &[u32]) -> Self {
        let mask = mask.filter(|mask| mask.iter().any(|share| *share != 1.0));
        let shares = mask.map(|mask| {
            let mut least = vec![1.0f32; first_at_place.len()];
            for (share, &first) in mask.iter().zip(first_at_place) {
                let least = &mut least[first as usize];
                *least = least.min(*share);
            }
            first_at_place
                .iter()
                .map(|&first| least[first as usize])
                .collect()
        });
        Self { shares }
    }

    /// Returns the freedom of some of the vertices, which become vertices 0, 1, ...
    pub(super) fn of_some(&self, vertices: &[u32]) -> Self {
        let some = |shares: &Vec<f32>| vertices.iter().map(|&v| shares[v as usize]).collect();
        Self {
            shares: self.shares.as_ref().map(some),
        }
    }

    /// Shares of all vertices; none if all are 1.
    pub(super) fn shares(&self) -> Option<&[f32]> {
        self.shares.as_deref()
    }

    /// Returns the share of a vertex.
    ///
    /// # Panics
    /// When there is no such vertex, unless all are free.
    pub fn of(&self, vertex: u32) -> f32 {
        (self.shares()).map_or(1.0, |shares| shares[vertex as usize])
    }
}
