//! Networks that run once a frame on the motion vectors. They compute the prior's coefficients, the
//! latent vector and the field's biases.

use crate::{
    GpuContext, GpuError, Precision,
    dense::{LinearDispatcher, LinearKernels, LinearMap, OutputMode, Regions},
    field::{FieldShape, latent_columns},
    kernel::{Dispatch, GROUP, Kernel, Source},
    start_memory::{MemoryRegions, MemoryUpdate, StartMemoryKernels},
};
use std::{ops::Range, slice::from_ref};
use unic_core::{Model, config::LatentCode, network::Linear, recurrence::Recurrence};
use wgpu::{Buffer, BufferUsages};

/// Linear layers between regions of an animator's vectors. Asset.
#[derive(Debug)]
pub(crate) struct MotionNetworks {
    /// Start of the normalised pair of motion vectors.
    pub(crate) pair: usize,
    /// Region of the recurrence's state; empty without a recurrence.
    pub(crate) memory: Range<usize>,
    /// Start of the biases of the field's layers, the head's at the end.
    pub(crate) biases: usize,
    /// Regions of the memory of the start, and of the residuals that the replay adds to the
    /// coefficients.
    pub(crate) start: MemoryRegions,
    prior: Vec<LinearDispatcher>,
    recurrence: Option<Oscillators>,
    start_memory: StartMemoryKernels,
    encoder: Vec<LinearDispatcher>,
    /// Kernel that picks the category of each channel.
    pick: Kernel,
    channels: usize,
    /// Layers that add the products with the latent vector to the field's biases.
    fold: Vec<LinearDispatcher>,
    /// Vectors before the first frame: zeros, and the biases of the layers without a latent vector.
    initial: Vec<f32>,
}

/// Effect of a pair of motion vectors on the state of the prior's recurrence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tick {
    /// First pair of a sequence: the recurrence starts in its steady state.
    First,
    /// Pair that follows another: the recurrence advances.
    Next,
    /// Pair of the current state: the recurrence stays.
    Same,
}

/// Recurrence of the prior on the device.
#[derive(Debug)]
struct Oscillators {
    /// Layers before the oscillators: embedding and drive.
    before: [LinearDispatcher; 2],
    start_steady: Kernel,
    advance: Kernel,
    poles: Buffer,
    count: usize,
    /// Layers after the oscillators: memory, hidden layer and head.
    after: [LinearDispatcher; 3],
}

/// Builder of linear layers that allocates their regions.
struct Builder<'a> {
    context: &'a GpuContext,
    kernels: LinearKernels,
    regions: Regions,
}

impl MotionNetworks {
    pub(crate) fn new(context: &GpuContext, model: &Model, shape: &FieldShape, precision: Precision) -> Self {
        let mut builder = Builder {
            context,
            kernels: LinearKernels::new(context),
            regions: Regions::default(),
        };
        let prior = model.prior();
        let pair = builder
            .regions
            .take(2 * model.config().motion.len(model.character().skeleton.len()));
        let coefficients = builder.regions.take(prior.len());
        let mut of_components = || builder.regions.take(prior.len());
        let (residuals, moved, given) = (of_components(), of_components(), of_components());
        let start = MemoryRegions {
            coefficients,
            moved,
            given: given..given + prior.len(),
            residuals,
            memory: builder.regions.take(4),
        };
        let memory = builder.regions.take(prior.state_len());
        let linear =
            (!prior.is_empty()).then(|| builder.full(&prior.map, pair, coefficients, OutputMode::Replace));
        let recurrence = prior.recurrence.as_ref();
        let recurrence =
            recurrence.map(|unit| Oscillators::new(&mut builder, unit, pair, memory, coefficients));
        let (encoder, logits) = builder.encoder(model, pair, precision);
        let encoding = &model.config().encoder;
        let channels = encoding.channels;
        let latent = builder.regions.take(encoding.latent_len());
        let biases = builder.regions.take(shape.biases());
        let fold = builder.fold(model, shape, latent, biases);
        // Only layers that read the latent vector are folded; the others keep these biases.
        let mut initial = vec![0.0; builder.regions.len()];
        shape.write_biases(model.field().layers(), &mut initial[biases..]);
        Self {
            pair,
            start_memory: StartMemoryKernels::new(context, model, &start),
            start,
            memory: memory..memory + prior.state_len(),
            biases,
            prior: linear.into_iter().collect(),
            recurrence,
            encoder,
            pick: pick(context, model, logits, latent),
            channels,
            fold,
            initial,
        }
    }

    /// Creates the buffer of an animator's vectors.
    pub(crate) fn vectors(&self, context: &GpuContext) -> Buffer {
        let bytes = size_of_val(&self.initial[..]);
        let vectors = context.zeroed("vectors", bytes, BufferUsages::empty());
        context
            .queue()
            .write_buffer(&vectors, 0, bytemuck::cast_slice(&self.initial));
        vectors
    }

    /// Makes the dispatches from the pair to the prior's coefficients.
    pub(crate) fn record_prior(
        &self,
        vectors: &Buffer,
        tick: Tick,
        update: MemoryUpdate,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let mut dispatches = all(&self.prior, vectors)?;
        if let Some(recurrence) = &self.recurrence {
            dispatches.extend(recurrence.record(vectors, tick)?);
        }
        dispatches.push(self.start_memory.record(vectors, update)?);
        Ok(dispatches)
    }

    /// Makes the dispatch that changes the coefficients to those of positions given in the current
    /// frame.
    pub(crate) fn record_given(&self, vectors: &Buffer) -> Result<Dispatch, GpuError> {
        self.start_memory.record_given(vectors)
    }

    /// Makes the dispatches from the pair to the field's biases.
    pub(crate) fn record_encoder(&self, vectors: &Buffer) -> Result<Vec<Dispatch>, GpuError> {
        let mut dispatches = all(&self.encoder, vectors)?;
        let groups = self.channels.div_ceil(GROUP);
        dispatches.push(self.pick.dispatch(&[(0, vectors)], groups)?);
        dispatches.extend(all(&self.fold, vectors)?);
        Ok(dispatches)
    }
}

fn all(maps: &[LinearDispatcher], vectors: &Buffer) -> Result<Vec<Dispatch>, GpuError> {
    maps.iter().map(|map| map.dispatch(vectors)).collect()
}

fn pick(context: &GpuContext, model: &Model, logits: usize, latent: usize) -> Kernel {
    let config = &model.config().encoder;
    let source = Source {
        text: include_str!("kernels/latent.wgsl"),
        entry: "pick",
        constants: &[
            ("CHANNELS", config.channels as f64),
            ("CATEGORIES", config.categories as f64),
            ("ONE_HOT", f64::from(u8::from(config.code == LatentCode::OneHot))),
            ("LOGITS", logits as f64),
            ("LATENT", latent as f64),
        ],
    };
    Kernel::new(context, &source)
}

impl Builder<'_> {
    /// Uploads a layer with all its columns, in f32.
    fn full(&self, layer: &Linear, from: usize, to: usize, output: OutputMode) -> LinearDispatcher {
        let columns = 0..layer.inputs;
        let map = LinearMap {
            layer,
            columns: from_ref(&columns),
            from,
            to,
            output,
        };
        self.kernels.map(self.context, Precision::F32, &map)
    }

    /// Uploads the encoder's layers; returns them and the start of the logits.
    fn encoder(
        &mut self,
        model: &Model,
        pair: usize,
        precision: Precision,
    ) -> (Vec<LinearDispatcher>, usize) {
        let layers = model.encoder().layers();
        let mut from = pair;
        let mut maps = Vec::with_capacity(layers.len());
        for (i, layer) in layers.iter().enumerate() {
            let to = self.regions.take(layer.outputs);
            let columns = 0..layer.inputs;
            let map = LinearMap {
                layer,
                columns: from_ref(&columns),
                from,
                to,
                output: if i + 1 < layers.len() {
                    OutputMode::Elu
                } else {
                    OutputMode::Replace
                },
            };
            maps.push(self.kernels.map(self.context, precision, &map));
            from = to;
        }
        (maps, from)
    }

    /// Uploads the columns of the field's layers that multiply the latent vector.
    // Their products are the same for all vertices of a frame, so they become a part of the biases.
    fn fold(&self, model: &Model, shape: &FieldShape, latent: usize, biases: usize) -> Vec<LinearDispatcher> {
        let layers = model.field().layers().iter().enumerate();
        let read = layers.filter(|(i, _)| shape.reads_latent(*i));
        read.map(|(i, layer)| {
            let map = LinearMap {
                layer,
                columns: &[latent_columns(model, layer)],
                from: latent,
                to: biases + i * shape.width,
                output: OutputMode::Replace,
            };
            self.kernels.map(self.context, Precision::F32, &map)
        })
        .collect()
    }
}

impl Oscillators {
    fn new(
        builder: &mut Builder,
        unit: &Recurrence,
        pair: usize,
        memory: usize,
        coefficients: usize,
    ) -> Self {
        let regions = &mut builder.regions;
        // Adjacent regions: the hidden layer reads both as one vector.
        let memory_features = regions.take(unit.memory.outputs);
        let embedding = regions.take(unit.embedding.outputs);
        let drive = regions.take(unit.drive.outputs);
        let hidden = regions.take(unit.hidden.outputs);
        let joined = LinearMap {
            layer: &unit.hidden,
            columns: &[0..unit.memory.outputs, unit.memory.outputs..unit.hidden.inputs],
            from: memory_features,
            to: hidden,
            output: OutputMode::Elu,
        };
        let constants = [
            ("OSCILLATORS", unit.poles.len() as f64),
            ("DRIVE", drive as f64),
            ("MEMORY", memory as f64),
        ];
        let kernel = |entry: &str| {
            let source = Source {
                text: include_str!("kernels/recurrence.wgsl"),
                entry,
                constants: &constants,
            };
            Kernel::new(builder.context, &source)
        };
        Self {
            before: [
                builder.full(&unit.embedding, pair, embedding, OutputMode::Elu),
                builder.full(&unit.drive, embedding, drive, OutputMode::Replace),
            ],
            start_steady: kernel("start_steady"),
            advance: kernel("advance"),
            poles: builder.context.upload("poles", &unit.poles),
            count: unit.poles.len(),
            after: [
                builder.full(&unit.memory, memory, memory_features, OutputMode::Elu),
                builder.kernels.map(builder.context, Precision::F32, &joined),
                builder.full(&unit.head, hidden, coefficients, OutputMode::Add),
            ],
        }
    }

    /// Makes the dispatches that update the oscillators and add their correction to the
    /// coefficients.
    fn record(&self, vectors: &Buffer, tick: Tick) -> Result<Vec<Dispatch>, GpuError> {
        let kernel = match tick {
            Tick::First => Some(&self.start_steady),
            Tick::Next => Some(&self.advance),
            Tick::Same => None,
        };
        // The head adds to the coefficients, which the linear map has just replaced.
        let mut dispatches = all(&self.before, vectors)?;
        if let Some(kernel) = kernel {
            let buffers = [(0, &self.poles), (1, vectors)];
            dispatches.push(kernel.dispatch(&buffers, self.count.div_ceil(GROUP))?);
        }
        dispatches.extend(all(&self.after, vectors)?);
        Ok(dispatches)
    }
}
