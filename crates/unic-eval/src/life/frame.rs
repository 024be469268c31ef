//! One frame of a garment, as the measures of life see it.

use super::{
    band_filter::{BandFilter, Shape},
    cloth::{Cloth, ClothFrame},
    self_crossings::SelfCrossings,
    welded::WeldedMesh,
};
use crate::{error::Result, kinematics::PreparedClip};
use glam::Vec3;
use unic_core::character::Garment;

/// Wrinkles, strain, bending and self-crossings of a garment in one frame.
pub(super) struct LifeFrame {
    /// Signal of each band at each vertex, band after band, metres.
    pub(super) signals: Vec<f32>,
    /// Strain and bending.
    pub(super) cloth: ClothFrame,
    /// Share of edges that pass through a face of the garment; none where they were not counted.
    pub(super) self_crossings: Option<f64>,
}

/// Measures of single frames of a garment. It is made once and shared by all threads.
pub(super) struct FrameMeasure<'a> {
    garment: &'a Garment,
    filter: BandFilter,
    cloth: Cloth,
    self_crossings: SelfCrossings,
}

impl<'a> FrameMeasure<'a> {
    /// Prepares the measures for a garment.
    ///
    /// # Errors
    /// A rest mesh whose smoothings cannot be factorised.
    pub(super) fn new(garment: &'a Garment) -> Result<Self> {
        let welded = WeldedMesh::new(&garment.rest);
        Ok(Self {
            garment,
            cloth: Cloth::new(&garment.rest, &welded),
            self_crossings: SelfCrossings::new(&welded),
            filter: BandFilter::new(welded)?,
        })
    }

    /// Returns the weight of each vertex of a band's signal: its lumped rest area, m².
    pub(super) fn weights(&self) -> &[f64] {
        self.filter.weights()
    }

    /// Returns the coarsest smoothing of the rest shape as the skeleton carries it in a frame.
    pub(super) fn skinned(&self, clip: &PreparedClip, frame: usize) -> Shape {
        let Garment { rest, weights, .. } = self.garment;
        let mut positions = Vec::new();
        let world_from_rest = clip.kinematics.world_from_rest(frame);
        weights.skin(&rest.vertices, world_from_rest, &mut positions);
        self.filter.coarsest(&positions)
    }

    /// Search for self-crossings, to be cloned for each piece of parallel work.
    pub(super) fn self_crossings(&self) -> &SelfCrossings {
        &self.self_crossings
    }

    /// Measures all of a shape but its self-crossings, given the world positions of all garment vertices
    /// in metres. `skinned` is the [skinned](Self::skinned) rest shape of the frame.
    pub(super) fn measure(&self, positions: &[Vec3], skinned: &Shape) -> LifeFrame {
        LifeFrame {
            signals: self.filter.signals(positions, skinned),
            cloth: self.cloth.measure(positions),
            self_crossings: None,
        }
    }
}
