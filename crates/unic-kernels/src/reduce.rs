//! The last step of the backward pass: reduction of the chunks' sums to gradients.

use rayon::prelude::*;

use crate::Field;
use crate::backward::{BackwardCall, BackwardScratch};
use crate::batch::BatchExtent;
use crate::buffer::Buffer;
use crate::layer::add_scaled;
use crate::panels::PANEL;

impl Field {
    /// Adds up the bias gradients of each group over the chunks, in order.
    pub(crate) fn sum_groups(&self, extent: &BatchExtent, scratch: &mut BackwardScratch) {
        scratch
            .groups
            .reset(extent.groups * self.slot_count() * self.slot_width());
        for chunk in &scratch.chunks {
            // A chunk may end within a group, whose sum is then in two chunks.
            let start = self.slot_range(chunk.first_group, 0).start;
            add_scaled(&mut scratch.groups[start..], 1.0, &chunk.groups);
        }
    }

    /// Computes the gradients of the latents: for each group the sum of W_zᵀ · (bias gradient of
    /// the group) over the maps that take the latent.
    pub(crate) fn latent_gradients(&self, sums: &Buffer, gradients: &mut [f32]) {
        if self.shape.latent == 0 {
            return;
        }
        gradients
            .par_chunks_mut(self.shape.latent)
            .enumerate()
            .for_each(|(group, gradient)| {
                gradient.fill(0.0);
                for (layer, slot) in self.latent_layers() {
                    let rows = self.parameters[layer.map.weight.clone()].chunks_exact(layer.map.inputs());
                    for (factor, row) in sums[self.slot_range(group, slot)].iter().zip(rows) {
                        add_scaled(gradient, *factor, &row[layer.map.varying_inputs()..]);
                    }
                }
            });
    }
}

impl BackwardCall<'_> {
    /// Adds the chunks' gradients to the flat vector, in the order of the chunks. Each task handles
    /// one row of a weight.
    pub(crate) fn add_parameter_gradients(&self, scratch: &BackwardScratch, mut gradients: &mut [f32]) {
        for (index, layer) in self.field.layers.iter().enumerate() {
            let (weight, rest) = std::mem::take(&mut gradients).split_at_mut(layer.map.weight.len());
            let (bias, rest) = rest.split_at_mut(layer.map.outputs);
            gradients = rest;
            let rows = weight.par_chunks_mut(layer.map.inputs()).zip(bias).enumerate();
            rows.for_each(|(row, (weight, bias))| self.add_row(index, row, weight, bias, scratch));
        }
    }

    /// Adds the gradients of one output of a map: its row of the weight, and its bias.
    fn add_row(
        &self,
        index: usize,
        row: usize,
        weight: &mut [f32],
        bias: &mut f32,
        scratch: &BackwardScratch,
    ) {
        let (layer, range) = (&self.field.layers[index], &self.ranges[index]);
        for chunk in &scratch.chunks {
            let panels = chunk.weights[range.weight.clone()].chunks_exact(layer.map.outputs * PANEL);
            for ((start, width), panel) in layer.input.starts().zip(panels) {
                add_scaled(&mut weight[start..start + width], 1.0, &panel[row * PANEL..]);
            }
            if layer.slot.is_none() {
                *bias += chunk.biases[range.bias.start + row];
            }
        }
        // The latent's columns of a weight: an outer product per group instead of per point.
        let Some(slot) = layer.slot else { return };
        for group in 0..self.extent.groups {
            let sum = scratch.groups[self.field.slot_range(group, slot).start + row];
            let latent = &self.batch.latents[group * layer.map.latent_inputs..];
            add_scaled(&mut weight[layer.map.varying_inputs()..], sum, latent);
            *bias += sum;
        }
    }
}
