//! The presets: named settings to start from.

use super::{
    BatchConfig, IntersectionConfig, IntersectionRule, LossConfig, ModelSettings, OptimiserConfig,
    PUBLISHED_EPOCHS, Products, ProjectionSettings, RecurrenceSettings, RecurrenceStart, Refit,
    RegularisationConfig, ReplaySettings, SizingSettings, SkinningSource, StateSettings, TrainConfig,
    ValidationConfig,
};
use unic_core::{
    config::{EncoderConfig, FieldConfig, IntersectionMode, LatentCode, PointInput},
    motion::{MotionLayout, NormalisationRule, NormalisedElements, Spring, VelocityScheme},
};

/// Named starting points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// The published method with its sizes, for comparison.
    Paper,
    /// The best that we know; see ARCHITECTURE.md.
    Standard,
    /// Small, for slow machines and tests.
    Tiny,
}

impl Preset {
    /// All of them.
    pub const ALL: [Preset; 3] = [Preset::Paper, Preset::Standard, Preset::Tiny];
}

impl TrainConfig {
    /// The settings of a preset.
    pub fn preset(preset: Preset) -> Self {
        match preset {
            Preset::Paper => paper(),
            Preset::Standard => standard(),
            Preset::Tiny => tiny(),
        }
    }
}

/// Sizes, optimiser, schedule and teacher forcing of the paper (section 4.1) and the authors'
/// release: 300 epochs of all training clips. A batch is subsampled, which the pointwise field
/// allows.
fn paper() -> TrainConfig {
    TrainConfig {
        seed: 1,
        motion_seconds: None,
        model: ModelSettings {
            layout: MotionLayout::Paper,
            velocity: VelocityScheme::Forward,
            springs: Vec::new(),
            normalisation: NormalisationRule::PAPER,
            encoder: EncoderConfig {
                hidden: vec![4096, 4096],
                channels: 128,
                categories: 8,
                code: LatentCode::PickedLogit,
            },
            field: FieldConfig {
                width: 256,
                hidden_layers: 8,
                skip: Some(5),
            },
            state: StateSettings::RootRelative,
        },
        optimiser: OptimiserConfig {
            // What 300 epochs are of about 1,300 pairs; every capture has its own number.
            steps: 3000,
            epochs: Some(PUBLISHED_EPOCHS),
            learning_rate: 1e-4,
            final_learning_rate: 1e-6,
            half_periods: 3.0,
            warmup: 0.0,
            weight_decay: 1e-4,
            clip_norm: 0.0,
            products: Products::F32,
        },
        batch: BatchConfig {
            windows: 128,
            points: 256,
            unroll_first: 1,
            unroll_last: 1,
            unroll_grown: 1.0,
        },
        regularisation: RegularisationConfig {
            dropout: 0.25,
            input_dropout: 0.25,
            dropout_by_window: false,
            state_noise_m: 0.0,
            mirror: false,
            average: 0.0,
        },
        loss: LossConfig { position: 1e4 },
        intersection: IntersectionConfig {
            rule: IntersectionRule::Paper,
            relaxation_m: IntersectionMode::RELAXATION_M,
            margin_m: IntersectionMode::MARGIN_M,
            at_inference: true,
        },
        projection: ProjectionSettings::default(),
        replay: ReplaySettings::default(),
        sizing: SizingSettings::default(),
        validation: ValidationConfig {
            every: 500,
            refit: Refit::Only,
        },
    }
}

/// A field that is small and briefly trained on purpose. Chosen by leaving clips out of the T-shirt
/// in the shared data (35 s of motion in all): wider fields and more steps fit the training clips
/// better and unseen ones worse, long rollouts help, and so does the prior, whose recurrence may be
/// wide: it is trained by epochs and judged by motions left out.
fn standard() -> TrainConfig {
    use PointInput::{Displacement, Rest, SkinVelocity, Up, Velocity};
    TrainConfig {
        model: ModelSettings {
            layout: MotionLayout::Heading,
            velocity: VelocityScheme::Backward,
            springs: Spring::OF_PRESETS.to_vec(),
            normalisation: NormalisationRule {
                elements: NormalisedElements::All,
                least_std: 0.02,
                limit: Some(5.0),
            },
            encoder: EncoderConfig {
                hidden: vec![128],
                channels: 32,
                categories: 8,
                code: LatentCode::PickedLogit,
            },
            field: FieldConfig {
                width: 32,
                hidden_layers: 4,
                skip: None,
            },
            state: StateSettings::Displacement {
                skinning: SkinningSource::Fitted,
                memory_s: 0.5,
                excursion_m: 0.02,
                prior_shapes: 64,
                recurrence: Some(RecurrenceSettings {
                    start: RecurrenceStart::Pretrained,
                    oscillators: 128,
                    width: 256,
                    steps: 3000,
                    epochs: 150,
                    learning_rate: 2e-3,
                    windows: 32,
                    frames: 96,
                    dropout: 0.1,
                    swing: 1.0,
                }),
                inputs: vec![Displacement, Velocity, Rest, Up, SkinVelocity],
            },
        },
        optimiser: OptimiserConfig {
            steps: 1000,
            epochs: None,
            learning_rate: 3e-4,
            final_learning_rate: 1e-6,
            half_periods: 1.0,
            warmup: 0.1,
            weight_decay: 1e-2,
            clip_norm: 1.0,
            products: Products::F32,
        },
        batch: BatchConfig {
            windows: 16,
            points: 64,
            unroll_first: 8,
            unroll_last: 24,
            unroll_grown: 0.6,
        },
        regularisation: RegularisationConfig {
            dropout: 0.5,
            input_dropout: 0.5,
            dropout_by_window: true,
            state_noise_m: 0.01,
            mirror: true,
            average: 0.98,
        },
        loss: LossConfig { position: 1e4 },
        intersection: IntersectionConfig {
            rule: IntersectionRule::Robust,
            ..paper().intersection
        },
        projection: ProjectionSettings {
            at_inference: true,
            ..ProjectionSettings::default()
        },
        replay: ReplaySettings {
            at_inference: true,
            ..ReplaySettings::default()
        },
        sizing: SizingSettings {
            sizes: vec![[64, 4], [128, 4], [256, 6]],
        },
        validation: ValidationConfig {
            every: 100,
            refit: Refit::AllClips,
        },
        ..paper()
    }
}

fn tiny() -> TrainConfig {
    let standard = standard();
    TrainConfig {
        model: ModelSettings {
            encoder: EncoderConfig {
                hidden: vec![64],
                channels: 16,
                categories: 8,
                code: LatentCode::PickedLogit,
            },
            field: FieldConfig {
                width: 32,
                hidden_layers: 4,
                skip: None,
            },
            state: state_of_tiny(standard.model.state),
            ..standard.model
        },
        optimiser: OptimiserConfig {
            steps: 100,
            ..standard.optimiser
        },
        batch: BatchConfig {
            windows: 8,
            points: 64,
            unroll_first: 4,
            unroll_last: 12,
            ..standard.batch
        },
        // Its library would be most of the model.
        replay: ReplaySettings::default(),
        sizing: SizingSettings::default(),
        ..standard
    }
}

/// A smaller recurrence, trained for less.
fn state_of_tiny(mut state: StateSettings) -> StateSettings {
    if let StateSettings::Displacement {
        recurrence: Some(recurrence),
        ..
    } = &mut state
    {
        *recurrence = RecurrenceSettings {
            start: RecurrenceStart::Random,
            oscillators: 16,
            width: 32,
            steps: 100,
            windows: 16,
            frames: 64,
            ..recurrence.clone()
        };
    }
    state
}
