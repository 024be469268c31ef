//! The parts of a step, for measurements.

/// Part of a step, reported by [`Animator::step_observed`](super::Animator::step_observed) when it
/// is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Forward kinematics and the motion vector.
    Motion,
    /// Skinning of the garment's rest shape.
    Skinning,
    /// Prior, motion encoder, and the products of the latent vector with the field's weights.
    Encoder,
    /// Deformation field at all vertices.
    Field,
    /// Posing of the body, and intersection handling of the state and of the shown positions.
    Intersections,
    /// World positions from states, and the addition of the strain projection's offsets.
    Positions,
    /// Strain projection; takes no time for a model without one.
    Projection,
    /// Vertex normals.
    Normals,
}

impl Stage {
    /// All stages in the order of a step.
    pub const ALL: [Self; 8] = [
        Self::Motion,
        Self::Skinning,
        Self::Encoder,
        Self::Field,
        Self::Intersections,
        Self::Positions,
        Self::Projection,
        Self::Normals,
    ];

    /// Name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Motion => "motion",
            Self::Skinning => "skinning",
            Self::Encoder => "encoder",
            Self::Field => "field",
            Self::Intersections => "intersections",
            Self::Positions => "positions",
            Self::Projection => "projection",
            Self::Normals => "normals",
        }
    }
}
