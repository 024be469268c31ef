//! The parts of a step, for those who measure them.

/// What a step has just done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Forward kinematics and the motion vector.
    Motion,
    /// The skeleton has carried the garment's points.
    Skinning,
    /// The prior, the motion encoder, the latent's share of the field.
    Encoder,
    /// The deformation field at all vertices.
    Field,
    /// Intersections in the state and in what is shown, with the posed body.
    Intersections,
    /// States to world positions.
    Positions,
    /// Normals.
    Normals,
}

impl Stage {
    /// In the order of a step.
    pub const ALL: [Self; 7] = [
        Self::Motion,
        Self::Skinning,
        Self::Encoder,
        Self::Field,
        Self::Intersections,
        Self::Positions,
        Self::Normals,
    ];

    /// As in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Motion => "motion",
            Self::Skinning => "skinning",
            Self::Encoder => "encoder",
            Self::Field => "field",
            Self::Intersections => "intersections",
            Self::Positions => "positions",
            Self::Normals => "normals",
        }
    }
}
