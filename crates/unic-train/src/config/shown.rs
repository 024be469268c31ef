//! Settings of what a finished model adds to its prediction: strain projection and replay.

use serde::{Deserialize, Serialize};
use unic_core::config::ProjectionConfig;

/// Largest value of [`ProjectionSettings::chord_deviations`], which cloth on the body has.
pub(crate) const MOST_CHORD_DEVIATIONS: f32 = 1.5;

/// Strain projection of the finished model, see [`unic_core::projection`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProjectionSettings {
    /// Strain projection of the finished model: on or off.
    pub at_inference: bool,
    /// Range of the length that an edge keeps around its mean in training, in standard deviations.
    pub deviations: f32,
    /// Least lengths of the chords of taut cloth that hangs free of the body, in standard deviations
    /// below their mean in training, 0 to 1.5. Held-out motion takes the largest, or a smaller one
    /// where the garment bends over a tenth more than the truth; the first one is taken where nothing
    /// is held out.
    #[serde(default = "widest_chords")]
    pub chord_deviations: Vec<f32>,
    /// Gauss-Seidel sweeps over the chords of each coarse level in a tick; no levels where it is 0,
    /// as in settings that were saved before there were any.
    #[serde(default)]
    pub coarse_sweeps: usize,
    /// Gauss-Seidel sweeps over all edges in a tick.
    pub sweeps: usize,
    /// Number of these sweeps that are followed by one over all hinges. Unless it is 0, hinges smooth
    /// what intersection handling has moved, too.
    pub bending_sweeps: usize,
    /// Shares of the bending that a sweep over the hinges may remove, 0 to 1. The one with which held-out
    /// motion bends as much as the truth is taken; the first one where nothing is held out.
    pub bending: Vec<f32>,
    /// Least distances of vertices along the smoothed cloth, in mean edge lengths, that pushes may
    /// restore; 0 for no pushes. Held-out motion chooses one by self-crossings beyond the truth's; the
    /// first one is taken where nothing is held out. No pushes in settings that were saved before there
    /// were any.
    #[serde(default = "no_order")]
    pub order: Vec<f32>,
    /// Least distance between layers of cloth that lie on each other at rest, in mean edge lengths, that
    /// pushes restore; 0 for no pushes, as in settings that were saved before there were any.
    #[serde(default)]
    pub layers: f32,
    /// Time constant of an offset's return to the prediction, seconds.
    pub pull_s: f32,
    /// Time constant of an offset's velocity, seconds.
    pub carry_s: f32,
    /// Largest offset, metres.
    pub radius_m: f32,
}

impl Default for ProjectionSettings {
    /// No projection, as in settings that were saved before there was one.
    fn default() -> Self {
        let ProjectionConfig {
            coarse_sweeps,
            sweeps,
            bending_sweeps,
            bending,
            order,
            layers,
            pull_s,
            carry_s,
            radius_m,
        } = ProjectionConfig::default();
        Self {
            at_inference: false,
            deviations: 0.5,
            chord_deviations: vec![MOST_CHORD_DEVIATIONS, 0.75, 0.0],
            coarse_sweeps,
            sweeps,
            bending_sweeps,
            bending: vec![bending, 0.35, 1.0, 0.2, 0.1],
            order: vec![order, 0.2, 0.35, 0.5],
            layers,
            pull_s,
            carry_s,
            radius_m,
        }
    }
}

impl ProjectionSettings {
    /// Least lengths of free chords of a model if nothing is held out, in standard deviations below the
    /// mean.
    pub(crate) fn first_chord_deviations(&self) -> f32 {
        // Settings without any are refused.
        self.chord_deviations
            .first()
            .copied()
            .unwrap_or(MOST_CHORD_DEVIATIONS)
    }

    /// Strain projection that the finished model has if nothing is held out.
    pub fn of_model(&self) -> Option<ProjectionConfig> {
        self.at_inference.then_some(ProjectionConfig {
            coarse_sweeps: self.coarse_sweeps,
            sweeps: self.sweeps,
            bending_sweeps: self.bending_sweeps,
            // Settings without any are refused.
            bending: self.bending.first().copied().unwrap_or(f32::NAN),
            order: self.order.first().copied().unwrap_or(f32::NAN),
            layers: self.layers,
            pull_s: self.pull_s,
            carry_s: self.carry_s,
            radius_m: self.radius_m,
        })
    }
}

/// Replay of wrinkles in the finished model, see [`unic_core::replay`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReplaySettings {
    /// Replay of the finished model: on or off.
    pub at_inference: bool,
    /// Number of shapes of wrinkles; large garments have fewer.
    #[serde(default = "default_shapes")]
    pub shapes: usize,
    /// Standard deviation to which the prior's wrinkles are brought on motions left out, by the
    /// truth's. Where a validation then chooses a factor, that decides.
    pub deviation: f32,
    /// Largest growth of the error on motions left out, as a share of itself: of the prior's by the
    /// wrinkles of that deviation, and of the animator's by the factor.
    pub cost: f32,
}

impl Default for ReplaySettings {
    /// No replay, as in settings that were saved before there was one.
    fn default() -> Self {
        Self {
            at_inference: false,
            shapes: default_shapes(),
            deviation: 0.9,
            cost: 0.03,
        }
    }
}

/// Least lengths of chords in settings that were saved before they could be set.
fn widest_chords() -> Vec<f32> {
    vec![MOST_CHORD_DEVIATIONS]
}

/// Orders in settings that were saved before there were any.
fn no_order() -> Vec<f32> {
    vec![0.0]
}

/// Number of shapes in settings that were saved before it could be set.
fn default_shapes() -> usize {
    64
}
