//! What is computed once a frame from the motion vectors: the prior's coefficients, the latent vector and
//! the field's biases.

use crate::{
    GpuContext, GpuError, Precision,
    dense::{Dense, DenseKernels, Map, Output, Regions},
    field::{FieldShape, latent_columns},
    kernel::{Dispatch, GROUP, Kernel, Source},
};
use std::{ops::Range, slice::from_ref};
use unic_core::{
    config::LatentCode, model::Model, motion::motion_len, network::Linear, recurrence::Recurrence,
};
use wgpu::{Buffer, BufferUsages};

/// Maps between regions of an animator's vectors. Asset.
#[derive(Debug)]
pub(crate) struct MotionNetworks {
    /// Where the normalised pair of motion vectors is.
    pub(crate) pair: usize,
    /// Where the prior's coefficients are.
    pub(crate) coefficients: usize,
    /// Where the recurrence's state is, if there is any.
    pub(crate) memory: Range<usize>,
    /// Where the biases of every layer of the field are, the head's at last.
    pub(crate) biases: usize,
    prior: Vec<Dense>,
    recurrence: Option<Oscillators>,
    encoder: Vec<Dense>,
    pick: Kernel,
    channels: usize,
    fold: Vec<Dense>,
    /// Vectors before the first frame: zeros and the biases that no latent vector changes.
    initial: Vec<f32>,
}

/// What a pair of motion vectors is to the recurrence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tick {
    /// The first of a sequence.
    First,
    /// One after another.
    Next,
    /// The state's own.
    Same,
}

#[derive(Debug)]
struct Oscillators {
    /// Embedding and drive.
    before: [Dense; 2],
    settle: Kernel,
    swing: Kernel,
    poles: Buffer,
    count: usize,
    /// Memory, hidden layer and head.
    after: [Dense; 3],
}

/// Makes the maps, taking regions as it goes.
struct Maker<'a> {
    context: &'a GpuContext,
    kernels: DenseKernels,
    regions: Regions,
}

impl MotionNetworks {
    pub(crate) fn new(context: &GpuContext, model: &Model, shape: &FieldShape, precision: Precision) -> Self {
        let mut maker = Maker {
            context,
            kernels: DenseKernels::new(context),
            regions: Regions::default(),
        };
        let prior = model.prior();
        let pair = maker
            .regions
            .take(2 * motion_len(model.character().skeleton.len()));
        let coefficients = maker.regions.take(prior.len());
        let memory = maker.regions.take(prior.state_len());
        let linear =
            (!prior.is_empty()).then(|| maker.full(&prior.map, pair, coefficients, Output::Replaces));
        let recurrence = prior.recurrence.as_ref();
        let recurrence =
            recurrence.map(|unit| Oscillators::new(&mut maker, unit, pair, memory, coefficients));
        let (encoder, logits) = maker.encoder(model, pair, precision);
        let encoding = &model.config().encoder;
        let channels = encoding.channels;
        let latent = maker.regions.take(encoding.latent_len());
        let biases = maker.regions.take(shape.biases());
        let fold = maker.fold(model, shape, latent, biases);
        let mut initial = vec![0.0; maker.regions.len()];
        shape.write_biases(model.field().layers(), &mut initial[biases..]);
        Self {
            pair,
            coefficients,
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

    /// The vectors of an animator.
    pub(crate) fn vectors(&self, context: &GpuContext) -> Buffer {
        let bytes = size_of_val(&self.initial[..]);
        let vectors = context.zeroed("vectors", bytes, BufferUsages::empty());
        context
            .queue()
            .write_buffer(&vectors, 0, bytemuck::cast_slice(&self.initial));
        vectors
    }

    /// From the pair to the prior's coefficients.
    pub(crate) fn record_prior(&self, vectors: &Buffer, tick: Tick) -> Result<Vec<Dispatch>, GpuError> {
        let mut dispatches = all(&self.prior, vectors)?;
        if let Some(recurrence) = &self.recurrence {
            dispatches.extend(recurrence.record(vectors, tick)?);
        }
        Ok(dispatches)
    }

    /// From the pair to the field's biases.
    pub(crate) fn record_encoder(&self, vectors: &Buffer) -> Result<Vec<Dispatch>, GpuError> {
        let mut dispatches = all(&self.encoder, vectors)?;
        let groups = self.channels.div_ceil(GROUP);
        dispatches.push(self.pick.dispatch(&[(0, vectors)], groups)?);
        dispatches.extend(all(&self.fold, vectors)?);
        Ok(dispatches)
    }
}

fn all(maps: &[Dense], vectors: &Buffer) -> Result<Vec<Dispatch>, GpuError> {
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

impl Maker<'_> {
    /// A map of all columns, in f32.
    fn full(&self, layer: &Linear, from: usize, to: usize, output: Output) -> Dense {
        let columns = 0..layer.inputs;
        let map = Map {
            layer,
            columns: from_ref(&columns),
            from,
            to,
            output,
        };
        self.kernels.map(self.context, Precision::F32, &map)
    }

    /// The encoder's layers, and where its logits are.
    fn encoder(&mut self, model: &Model, pair: usize, precision: Precision) -> (Vec<Dense>, usize) {
        let layers = model.encoder().layers();
        let mut from = pair;
        let mut maps = Vec::with_capacity(layers.len());
        for (i, layer) in layers.iter().enumerate() {
            let to = self.regions.take(layer.outputs);
            let columns = 0..layer.inputs;
            let map = Map {
                layer,
                columns: from_ref(&columns),
                from,
                to,
                output: if i + 1 < layers.len() {
                    Output::Elu
                } else {
                    Output::Replaces
                },
            };
            maps.push(self.kernels.map(self.context, precision, &map));
            from = to;
        }
        (maps, from)
    }

    /// The latent vector's share of the field's layers.
    fn fold(&self, model: &Model, shape: &FieldShape, latent: usize, biases: usize) -> Vec<Dense> {
        let layers = model.field().layers().iter().enumerate();
        let read = layers.filter(|(i, _)| shape.reads_latent(*i));
        read.map(|(i, layer)| {
            let map = Map {
                layer,
                columns: &[latent_columns(model, layer)],
                from: latent,
                to: biases + i * shape.width,
                output: Output::Replaces,
            };
            self.kernels.map(self.context, Precision::F32, &map)
        })
        .collect()
    }
}

impl Oscillators {
    fn new(maker: &mut Maker, unit: &Recurrence, pair: usize, memory: usize, coefficients: usize) -> Self {
        let regions = &mut maker.regions;
        // The hidden layer reads both as one vector.
        let remembered = regions.take(unit.memory.outputs);
        let embedding = regions.take(unit.embedding.outputs);
        let drive = regions.take(unit.drive.outputs);
        let hidden = regions.take(unit.hidden.outputs);
        let joined = Map {
            layer: &unit.hidden,
            columns: &[0..unit.memory.outputs, unit.memory.outputs..unit.hidden.inputs],
            from: remembered,
            to: hidden,
            output: Output::Elu,
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
            Kernel::new(maker.context, &source)
        };
        Self {
            before: [
                maker.full(&unit.embedding, pair, embedding, Output::Elu),
                maker.full(&unit.drive, embedding, drive, Output::Replaces),
            ],
            settle: kernel("settle"),
            swing: kernel("swing"),
            poles: maker.context.upload("poles", &unit.poles),
            count: unit.poles.len(),
            after: [
                maker.full(&unit.memory, memory, remembered, Output::Elu),
                maker.kernels.map(maker.context, Precision::F32, &joined),
                maker.full(&unit.head, hidden, coefficients, Output::Adds),
            ],
        }
    }

    fn record(&self, vectors: &Buffer, tick: Tick) -> Result<Vec<Dispatch>, GpuError> {
        let kernel = match tick {
            Tick::First => Some(&self.settle),
            Tick::Next => Some(&self.swing),
            Tick::Same => None,
        };
        let mut dispatches = all(&self.before, vectors)?;
        if let Some(kernel) = kernel {
            let buffers = [(0, &self.poles), (1, vectors)];
            dispatches.push(kernel.dispatch(&buffers, self.count.div_ceil(GROUP))?);
        }
        dispatches.extend(all(&self.after, vectors)?);
        Ok(dispatches)
    }
}
