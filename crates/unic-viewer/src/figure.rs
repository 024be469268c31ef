//! Dressed character: body and garment, stepped at the model's rate and shown at any rate.

use crate::{Material, Mesh, Part, Shading, Shape, Skinning, TickedShape, ViewerError};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Animator, Model, Pose, Start, StepInput};
use unic_gpu::{GpuAnimator, GpuContext, GpuModel, Precision, wgpu};

/// Model, ready to be worn by figures. An asset.
#[derive(Clone, Debug)]
pub struct Outfit {
    /// Name to show.
    pub name: String,
    /// Looks of the garment.
    pub cloth: Material,
    model: Arc<Model>,
    body_mesh: Arc<Mesh>,
    garment_mesh: Arc<Mesh>,
    device: Option<Arc<GpuModel>>,
}

impl Outfit {
    /// Prepares a model for the processor, or for a device if one is given.
    ///
    /// # Errors
    /// A model that the device cannot run.
    pub fn new(
        name: String,
        model: Arc<Model>,
        cloth: Material,
        device: Option<&GpuContext>,
    ) -> Result<Self, ViewerError> {
        let on_device = |context| GpuModel::new(context, Arc::clone(&model), Precision::F32).map(Arc::new);
        Ok(Self {
            name,
            cloth,
            body_mesh: Arc::new(Mesh::new(&model.character().body)),
            garment_mesh: Arc::new(Mesh::new(&model.garment().rest)),
            device: device.map(on_device).transpose()?,
            model,
        })
    }

    /// Whether the garment is computed on a graphics device.
    pub fn is_on_device(&self) -> bool {
        self.device.is_some()
    }

    /// Model of the garment.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }
}

/// Character with a garment in motion.
#[derive(Debug)]
pub struct Figure {
    outfit: Arc<Outfit>,
    garment: Garment,
    body: TickedShape,
    skinning: Skinning,
    /// Place between the last two ticks.
    share: f32,
}

/// Garment where it is computed.
// Boxed: an animator on a device is much larger than one on the processor.
#[derive(Debug)]
enum Garment {
    Host(Box<Animator>, TickedShape),
    Device(Box<GpuAnimator>, wgpu::Buffer),
}

/// Looks of a [`Figure`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Looks {
    /// Body.
    pub skin: Material,
    /// Garment.
    pub cloth: Material,
    /// Quantity that is shown.
    pub shading: Shading,
}

impl Figure {
    /// Dresses a character that stands in `pose`.
    ///
    /// # Errors
    /// A pose of another skeleton; too little memory on the device.
    pub fn new(outfit: Arc<Outfit>, pose: &Pose, wind: Vec3) -> Result<Self, ViewerError> {
        let garment = match &outfit.device {
            None => {
                let animator = Animator::new(Arc::clone(&outfit.model));
                Garment::Host(Box::new(animator), TickedShape::default())
            }
            Some(model) => {
                let animator = GpuAnimator::new(Arc::clone(model))?;
                let before = earlier_vertices(model, &animator);
                Garment::Device(Box::new(animator), before)
            }
        };
        let mut figure = Self {
            outfit,
            garment,
            body: TickedShape::default(),
            skinning: Skinning::default(),
            share: 1.0,
        };
        figure.reset(pose, wind)?;
        Ok(figure)
    }

    /// Outfit that the character wears.
    pub fn outfit(&self) -> &Arc<Outfit> {
        &self.outfit
    }

    /// Starts the garment again, from its mean shape.
    ///
    /// # Errors
    /// A pose of another skeleton or with numbers that are not finite.
    pub fn reset(&mut self, pose: &Pose, wind: Vec3) -> Result<(), ViewerError> {
        let input = step_input(pose, wind);
        match &mut self.garment {
            Garment::Host(animator, shape) => {
                let frame = animator.reset(&input, Start::MeanShape)?;
                shape.cut(frame.positions, frame.normals);
            }
            Garment::Device(animator, before) => {
                animator.reset(&input, Start::MeanShape)?;
                keep_vertices(animator, before);
            }
        }
        let (positions, normals) = self.skinning.body(self.outfit.model.character(), pose);
        self.body.cut(positions, normals);
        self.interpolate(1.0);
        Ok(())
    }

    /// Steps by a tick to a new pose.
    ///
    /// # Errors
    /// A pose of another skeleton or with numbers that are not finite.
    pub fn step(&mut self, pose: &Pose, wind: Vec3) -> Result<(), ViewerError> {
        let input = step_input(pose, wind);
        match &mut self.garment {
            Garment::Host(animator, shape) => {
                let frame = animator.step(&input)?;
                shape.tick(frame.positions, frame.normals);
            }
            Garment::Device(animator, before) => {
                keep_vertices(animator, before);
                animator.step(&input)?;
            }
        }
        let (positions, normals) = self.skinning.body(self.outfit.model.character(), pose);
        self.body.tick(positions, normals);
        Ok(())
    }

    /// Moves what is shown to a place between the last two ticks: 0 is the earlier one, 1 the later
    /// one.
    pub fn interpolate(&mut self, share: f32) {
        self.share = share.clamp(0.0, 1.0);
        self.body.interpolate(self.share);
        if let Garment::Host(_, shape) = &mut self.garment {
            shape.interpolate(self.share);
        }
    }

    /// Body and garment, to be drawn.
    pub fn parts(&self, looks: Looks) -> [Part<'_>; 2] {
        let shape = match &self.garment {
            Garment::Host(_, shape) => Shape::Host(shape.shown()),
            Garment::Device(animator, before) => Shape::Device {
                before,
                now: animator.vertex_buffer(),
                share: self.share,
            },
        };
        let part = |mesh, shape, material| Part {
            mesh,
            shape,
            material,
            colours: None,
            shading: looks.shading,
        };
        [
            part(&self.outfit.body_mesh, Shape::Host(self.body.shown()), looks.skin),
            part(&self.outfit.garment_mesh, shape, looks.cloth),
        ]
    }
}

fn step_input(pose: &Pose, wind: Vec3) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind,
    }
}

/// Makes the buffer of the vertices of the tick before.
fn earlier_vertices(model: &GpuModel, animator: &GpuAnimator) -> wgpu::Buffer {
    model.context().device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("vertices of the earlier tick"),
        size: animator.vertex_buffer().size(),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Copies the vertices on the device, before a step replaces them.
fn keep_vertices(animator: &GpuAnimator, before: &wgpu::Buffer) {
    let context = animator.asset().context();
    let mut encoder = context.device().create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(animator.vertex_buffer(), 0, before, 0, before.size());
    context.queue().submit([encoder.finish()]);
}
