//! From the chunks' sums to gradients: the last step of backward.

use rayon::prelude::*;

use crate::Field;
use crate::backward::{BackwardScratch, Call};
use crate::batch::Extent;
use crate::buffer::Buffer;
use crate::layer::add_scaled;
use crate::panels::PANEL;

impl Field {
    /// Adds the chunks' sums of each group, in order.
    pub(crate) fn sum_groups(&self, extent: &Extent, scratch: &mut BackwardScratch) {
        scratch
            .groups
            .reset(extent.groups * self.slots() * self.slot_width());
        for chunk in &scratch.chunks {
            let start = self.slot_range(chunk.first_group, 0).start;
            add_scaled(&mut scratch.groups[start..], 1.0, &chunk.groups);
        }
    }

    /// `dz_g = Σ over maps with latent of W_zᵀ · (sum of the group's gradients)`.
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

impl Call<'_> {
    /// Sums the chunks' gradients in order and adds them to the flat vector, a row of a weight a task.
    pub(crate) fn add_parameter_gradients(&self, scratch: &BackwardScratch, mut gradients: &mut [f32]) {
        for (index, layer) in self.field.layers.iter().enumerate() {
            let (weight, rest) = std::mem::take(&mut gradients).split_at_mut(layer.map.weight.len());
            let (bias, rest) = rest.split_at_mut(layer.map.outputs);
            gradients = rest;
            let rows = weight.par_chunks_mut(layer.map.inputs()).zip(bias).enumerate();
            rows.for_each(|(row, (weight, bias))| self.add_row(index, row, weight, bias, scratch));
        }
    }

    fn add_row(
        &self,
        index: usize,
        row: usize,
        weight: &mut [f32],
        bias: &mut f32,
        scratch: &BackwardScratch,
    ) {
        let (layer, place) = (&self.field.layers[index], &self.places[index]);
        for chunk in &scratch.chunks {
            let panels = chunk.weights[place.weight.clone()].chunks_exact(layer.map.outputs * PANEL);
            for ((start, width), panel) in layer.input.starts().zip(panels) {
                add_scaled(&mut weight[start..start + width], 1.0, &panel[row * PANEL..]);
            }
            if layer.slot.is_none() {
                *bias += chunk.biases[place.bias.start + row];
            }
        }
        let Some(slot) = layer.slot else { return };
        for group in 0..self.extent.groups {
            let sum = scratch.groups[self.field.slot_range(group, slot).start + row];
            let latent = &self.batch.latents[group * layer.map.latent_inputs..];
            add_scaled(&mut weight[layer.map.varying_inputs()..], sum, latent);
            *bias += sum;
        }
    }
}
