//! A trained model on a device.

use crate::{
    GpuContext, GpuError,
    body::Body,
    field::{FieldKernel, FieldShape},
    garment::Garment,
    motion::MotionNetworks,
};
use std::sync::Arc;
use unic_core::model::Model;

/// What the networks compute in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// f32 throughout: equal to the runtime on the CPU but for rounding.
    #[default]
    F32,
    /// Halves: weights of encoder and field, activations between the field's layers and sums of eight of
    /// their products. Everything else is f32. Needs [`wgpu::Features::SHADER_F16`].
    F16,
    /// Halves in the field's products, on the device's matrix units, with sums in f32; the encoder's as in
    /// [`F16`](Self::F16). Needs a context made by [`GpuContext::with_matrix_units`], on a device that has any.
    F16Matrix,
}

/// The asset: weights, meshes and compiled kernels, immutable, shared by the
/// [`GpuAnimator`](crate::GpuAnimator)s of one device.
#[derive(Debug)]
pub struct GpuModel {
    pub(crate) context: GpuContext,
    pub(crate) model: Arc<Model>,
    pub(crate) networks: MotionNetworks,
    pub(crate) field: FieldKernel,
    pub(crate) garment: Garment,
    pub(crate) body: Body,
    precision: Precision,
}

impl GpuModel {
    /// Uploads a model and compiles its kernels.
    ///
    /// # Errors
    /// A model that is larger than the device's limits allow, a precision that it does not have,
    /// memory that does not suffice.
    pub fn new(context: &GpuContext, model: Arc<Model>, precision: Precision) -> Result<Self, GpuError> {
        let shape = FieldShape::new(context, &model, precision)?;
        context.checked(|| {
            let networks = MotionNetworks::new(context, &model, &shape, precision);
            Ok(Self {
                field: FieldKernel::new(context, &model, shape, precision, networks.biases),
                garment: Garment::new(context, &model, &shape, networks.coefficients),
                body: Body::new(context, &model)?,
                networks,
                context: context.clone(),
                model,
                precision,
            })
        })
    }

    /// The model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The device that it is on.
    pub fn context(&self) -> &GpuContext {
        &self.context
    }

    /// What its networks compute in.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Floating-point operations of the field at all vertices: the arithmetic floor of a frame, two a
    /// multiply-add, with the latent vector's share folded into biases.
    pub fn field_flop(&self) -> f64 {
        self.model.vertex_count() as f64 * self.field.flop_per_vertex(&self.model) as f64
    }
}
