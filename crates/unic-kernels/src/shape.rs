//! Sizes of the field and the place of every parameter.

use std::ops::Range;

use crate::KernelError;

/// Sizes of a garment field: a perceptron applied to every point of a garment alone, driven by one latent per group.
///
/// Linear map 0 takes `[x, z]`; the map `skip`, counted from 0, takes `[hidden, x, z]`; every other map takes the
/// hidden vector; the last one is the head. A ReLU follows every map but the head. The published field
/// (arXiv 2603.25580) is [`FieldShape::PAPER`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FieldShape {
    /// Numbers given for each point, P.
    pub point_inputs: usize,
    /// Numbers in a group's latent z, L; may be 0.
    pub latent: usize,
    /// Width of every hidden layer, H.
    pub hidden: usize,
    /// Hidden layers, N; the field has N + 1 linear maps.
    pub hidden_layers: usize,
    /// Index, 1 to N, of the linear map before which the input is concatenated again.
    pub skip: Option<usize>,
    /// Numbers computed for each point, O.
    pub outputs: usize,
}

/// One linear map of the field and its slices of the flat parameter vector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinearMap {
    /// Columns fed by the previous layer.
    pub hidden_inputs: usize,
    /// Columns fed by the point's own input; they follow the hidden ones.
    pub point_inputs: usize,
    /// Columns fed by the latent; they come last.
    pub latent_inputs: usize,
    /// Rows.
    pub outputs: usize,
    /// Where the weight lies, row-major, `[outputs][inputs]`.
    pub weight: Range<usize>,
    /// Where the bias lies, `[outputs]`.
    pub bias: Range<usize>,
}

impl LinearMap {
    /// Columns of the weight.
    pub fn inputs(&self) -> usize {
        self.varying_inputs() + self.latent_inputs
    }

    /// Columns whose input differs from point to point: all but the latent's.
    pub(crate) fn varying_inputs(&self) -> usize {
        self.hidden_inputs + self.point_inputs
    }
}

impl FieldShape {
    /// The published field: 3 + 128 inputs, eight hidden layers of 256, skip before the sixth map, 3 outputs.
    pub const PAPER: Self = Self {
        point_inputs: 3,
        latent: 128,
        hidden: 256,
        hidden_layers: 8,
        skip: Some(5),
        outputs: 3,
    };

    /// Largest width accepted for any layer: bounds what a damaged file can make the field allocate.
    pub const MAX_WIDTH: usize = 4096;

    /// Largest number of hidden layers accepted.
    pub const MAX_LAYERS: usize = 64;

    /// Refuses sizes of zero (the latent may be empty), sizes past the limits and a skip outside 1..=N.
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

    /// The N + 1 linear maps in order, with the place of their weights and biases.
    ///
    /// Map `i` is what PyTorch would call `field.{i}.weight` and `field.{i}.bias`.
    pub fn layout(&self) -> Vec<LinearMap> {
        let mut start = 0;
        (0..=self.hidden_layers)
            .map(|index| self.linear_map(index, &mut start))
            .collect()
    }

    /// Length of the flat parameter vector.
    pub fn parameter_count(&self) -> usize {
        self.layout().last().map_or(0, |head| head.bias.end)
    }

    /// Floating-point operations of one point's forward pass, a multiply-add counted as two, without the latent's
    /// share, which is computed once per group. Forward and backward together take three times as many.
    pub fn flops_per_point(&self) -> u64 {
        self.layout()
            .iter()
            .map(|map| 2 * (map.varying_inputs() * map.outputs) as u64)
            .sum()
    }

    fn linear_map(&self, index: usize, start: &mut usize) -> LinearMap {
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
