//! Trained models on a device.

use crate::{
    GpuContext, GpuError,
    body::Body,
    field::{FieldKernel, FieldShape},
    garment::Garment,
    motion::MotionNetworks,
    projection::Projection,
};
use std::sync::Arc;
use unic_core::Model;

/// Precision of the networks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// f32 throughout: equal to the CPU but for rounding.
    #[default]
    F32,
    /// f16 for the weights of encoder and field, for activations between the field's layers, and
    /// for sums of eight of their products. Everything else is f32. Needs
    /// [`wgpu::Features::SHADER_F16`].
    F16,
    /// f16 for the field's products on the device's matrix units, with sums in f32. The encoder is
    /// as in [`F16`](Self::F16). Needs a context made by [`GpuContext::with_matrix_units`], on a
    /// device that has such units.
    F16Matrix,
}

/// Model on a device: weights, meshes and compiled kernels.
///
/// Asset: immutable, and shared by the [`GpuAnimator`](crate::GpuAnimator)s of one device.
#[derive(Debug)]
pub struct GpuModel {
    pub(crate) context: GpuContext,
    pub(crate) model: Arc<Model>,
    pub(crate) networks: MotionNetworks,
    pub(crate) field: FieldKernel,
    pub(crate) garment: Garment,
    pub(crate) body: Body,
    /// Strain projection, if the model has one.
    pub(crate) projection: Option<Projection>,
    precision: Precision,
}

impl GpuModel {
    /// Uploads a model and compiles its kernels.
    ///
    /// # Errors
    /// Fails on a model that exceeds the device's limits, a precision that the device does not
    /// have, and too little memory.
    pub fn new(context: &GpuContext, model: Arc<Model>, precision: Precision) -> Result<Self, GpuError> {
        // Limits are checked before anything is created: their errors have better messages than the
        // device's.
        let shape = FieldShape::new(context, &model, precision)?;
        context.checked(|| {
            let networks = MotionNetworks::new(context, &model, &shape, precision);
            Ok(Self {
                field: FieldKernel::new(context, &model, shape, precision, networks.biases),
                garment: Garment::new(context, &model, &shape, &networks.start),
                body: Body::new(context, &model)?,
                projection: (model.projection()).map(|projection| {
                    let share = networks.start.share();
                    Projection::new(context, &model, projection, share)
                }),
                networks,
                context: context.clone(),
                model,
                precision,
            })
        })
    }

    /// Model that was uploaded.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Context of the device that holds the model.
    pub fn context(&self) -> &GpuContext {
        &self.context
    }

    /// Precision of the networks.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Number of floating-point operations of the field at all vertices of a frame. A multiply-add
    /// counts two; products with the latent vector are excluded, since they are computed once a
    /// frame.
    pub fn field_flop(&self) -> f64 {
        self.model.vertex_count() as f64 * self.field.flop_per_vertex(&self.model) as f64
    }
}
