//! Sizes of the field and the layout of its parameters.

use std::ops::Range;

use crate::KernelError;

/// Sizes of a garment field: a multilayer perceptron that is applied to each point of a garment
/// separately, with one latent vector per group of points.
///
/// Linear map 0 takes `[x, z]`, the point's input and the latent. The map `skip`, counted from 0,
/// takes `[hidden, x, z]`. Every other map takes the hidden vector. The last map is the head; a
/// ReLU follows every other one. The published field (arXiv 2603.25580) is [`FieldShape::PAPER`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FieldShape {
    /// Number of input values per point, P.
    pub point_inputs: usize,
    /// Length of a group's latent z, L; may be 0.
    pub latent: usize,
    /// Width of every hidden layer, H.
    pub hidden: usize,
    /// Number of hidden layers, N; the field has N + 1 linear maps.
    pub hidden_layers: usize,
    /// Index, 1 to N, of the linear map that takes the point's input and the latent again.
    pub skip: Option<usize>,
    /// Number of output values per point, O.
    pub outputs: usize,
}

/// One linear map of the field with its ranges in the flat parameter vector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinearMap {
    /// Number of weight columns for the previous layer; they come first.
    pub hidden_inputs: usize,
    /// Number of weight columns for the point's input; they follow the hidden ones.
    pub point_inputs: usize,
    /// Number of weight columns for the latent; they come last.
    pub latent_inputs: usize,
    /// Number of weight rows.
    pub outputs: usize,
    /// Range of the weight in the parameter vector, row-major, `[outputs][inputs]`.
    pub weight: Range<usize>,
    /// Range of the bias in the parameter vector, `[outputs]`.
    pub bias: Range<usize>,
}

impl LinearMap {
    /// Returns the number of weight columns.
    pub fn inputs(&self) -> usize {
        self.varying_inputs() + self.latent_inputs
    }

    /// Returns the number of weight columns whose input differs from point to point: all but the
    /// latent's.
    pub(crate) fn varying_inputs(&self) -> usize {
        self.hidden_inputs + self.point_inputs
    }
}

impl FieldShape {
    /// The published field: 3 + 128 inputs, eight hidden layers of 256, skip into the sixth map,
    /// 3 outputs.
    pub const PAPER: Self = Self {
        point_inputs: 3,
        latent: 128,
        hidden: 256,
        hidden_layers: 8,
        skip: Some(5),
        outputs: 3,
    };

    /// Largest valid width of any layer. It bounds the memory that a damaged file can make the
    /// field allocate.
    pub const MAX_WIDTH: usize = 4096;

    /// Largest valid number of hidden layers.
    pub const MAX_LAYERS: usize = 64;

    /// Checks that all sizes are in range.
    ///
    /// # Errors
    /// Returns [`KernelError::Size`] for a size of zero (except for the latent), a size above the
    /// limits, or a skip outside 1..=N.
    pub fn validate(&self) -> Result<(), KernelError> {
        within("point_inputs", self.point_inputs, 1..=Self::MAX_WIDTH)?;
        within("latent", self.latent, 0..=Self::MAX_WIDTH)?;
        within("hidden", self.hidden, 1..=Self::MAX_WIDTH)?;
        within("hidden_layers", self.hidden_layers, 1..=Self::MAX_LAYERS)?;
        within("outputs", self.outputs, 1..=Self::MAX_WIDTH)?;
        match self.skip {
            Some(skip) => within("skip", skip, 1..=self.hidden_layers),
            None => Ok(()),
        }
    }

    /// Returns the N + 1 linear maps in order, with the ranges of their weights and biases.
    ///
    /// In PyTorch's naming, map `i` has the parameters `field.{i}.weight` and `field.{i}.bias`.
    pub fn layout(&self) -> Vec<LinearMap> {
        let mut start = 0;
        (0..=self.hidden_layers)
            .map(|index| self.linear_map(index, &mut start))
            .collect()
    }

    /// Returns the length of the flat parameter vector.
    pub fn parameter_count(&self) -> usize {
        self.layout().last().map_or(0, |head| head.bias.end)
    }

    /// Returns the number of floating-point operations of one point's forward pass. A multiply-add
    /// counts as two.
    ///
    /// The latent's contribution does not count, because it is computed once per group. Forward and
    /// backward pass together take three times as many operations.
    pub fn flops_per_point(&self) -> u64 {
        self.layout()
            .iter()
            .map(|map| 2 * (map.varying_inputs() * map.outputs) as u64)
            .sum()
    }

    fn linear_map(&self, index: usize, start: &mut usize) -> LinearMap {
        // The order of columns is that of the concatenation [hidden, x, z].
        let takes_input = index == 0 || self.skip == Some(index);
        let hidden_inputs = if index == 0 { 0 } else { self.hidden };
        let (point_inputs, latent_inputs) = if takes_input {
            (self.point_inputs, self.latent)
        } else {
            (0, 0)
        };
        let outputs = if index == self.hidden_layers {
            self.outputs
        } else {
            self.hidden
        };
        let weight = *start..*start + outputs * (hidden_inputs + point_inputs + latent_inputs);
        let bias = weight.end..weight.end + outputs;
        *start = bias.end;
        LinearMap {
            hidden_inputs,
            point_inputs,
            latent_inputs,
            outputs,
            weight,
            bias,
        }
    }
}

fn within(
    what: &'static str,
    found: usize,
    range: std::ops::RangeInclusive<usize>,
) -> Result<(), KernelError> {
    if range.contains(&found) {
        return Ok(());
    }
    Err(KernelError::Size {
        what,
        min: *range.start(),
        max: *range.end(),
        found,
    })
}
