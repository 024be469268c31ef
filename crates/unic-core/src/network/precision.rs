//! How exactly the networks calculate.

/// Numbers that the networks' products are taken in; chosen when a model is loaded
/// ([`Model::with_precision`](crate::model::Model::with_precision)).
///
/// Sums, biases, the inputs of a vertex and the last layer of the field are f32 in all of them. Whole
/// numbers are scaled by output for weights and by vertex for activations, whose largest takes the whole
/// range, so that nothing needs calibration and a vertex does not depend on its neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Precision {
    /// Single precision.
    #[default]
    F32,
    /// 8 significant bits, on matrix units where the processor has them. The encoder's weights, which memory
    /// has to deliver every frame, are whole numbers of 8 bits by row.
    Bf16,
    /// Whole numbers, 14 bits of activation by weights as fine as sums of 32 bits allow; the encoder's
    /// weights are of 16 bits.
    Int16,
    /// 8 bits of activation by 8 bits of weight; the encoder's weights as well.
    Int8,
}

impl Precision {
    /// From exact to coarse.
    pub const ALL: [Self; 4] = [Self::F32, Self::Bf16, Self::Int16, Self::Int8];

    /// As commands and tables write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Bf16 => "bf16",
            Self::Int16 => "int16",
            Self::Int8 => "int8",
        }
    }
}
