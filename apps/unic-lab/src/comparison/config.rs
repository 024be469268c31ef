//! Settings of networks of other methods.

use serde::{Deserialize, Serialize};
use unic_core::{
    config::{EncoderConfig, LatentCode},
    motion::{MotionLayout, VelocityScheme},
};
use unic_train::{OptimiserConfig, Products, SettingsError};

/// Method of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ComparisonKind {
    /// Input is the pose alone, without velocities and memory.
    PoseOnly,
    /// Input is recent motion, output the transforms of a few dozen virtual bones.
    VirtualBones,
    /// Inputs are the paper's motion code and one feature of the whole garment, which are decoded
    /// to all vertices at once. Trained one step at a time.
    GlobalFeature,
}

/// Settings of a training: everything that it depends on beside its clips.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ComparisonConfig {
    /// Seed of all random streams.
    pub(crate) seed: u64,
    /// Layout of the motion vector: coordinate frames and units.
    pub(crate) layout: MotionLayout,
    /// Scheme of the velocities in the motion vector.
    pub(crate) velocity: VelocityScheme,
    /// Quantity of the garment that the subspace holds.
    pub(crate) surface: SurfaceKind,
    /// Subspace of the garment.
    pub(crate) space: SpaceSettings,
    /// Elements of a motion vector that the network reads.
    pub(crate) reads: MotionElements,
    /// Ages of the motion vectors that the network reads, seconds. Each is rounded to a frame. Ages
    /// above zero are at least one frame.
    pub(crate) lags_s: Vec<f32>,
    /// Widths of the hidden layers before the coefficients.
    pub(crate) hidden: Vec<usize>,
    /// Sizes for the previous garment as a further input. Without them the input is the motion
    /// alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) global_feature: Option<GlobalFeatureSettings>,
    /// Dropout rate of hidden activations in the map that reads the motion.
    pub(crate) dropout: f32,
    /// Dropout rate of the motion itself.
    pub(crate) input_dropout: f32,
    /// Mirroring of half of the training frames, where skeleton and garment are symmetric.
    pub(crate) mirror: bool,
    /// Number of frames in a step.
    pub(crate) frames: usize,
    /// Settings of AdamW and its schedule.
    pub(crate) optimiser: OptimiserConfig,
}

/// Quantity of the garment that a subspace holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SurfaceKind {
    /// Displacements from the skinned garment, in the rotated frames of the vertices.
    Displacement,
    /// Positions relative to the root joint, as in the paper.
    RootRelative,
}

/// Kind and size of a subspace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum SpaceSettings {
    /// Number of principal components.
    Components(usize),
    /// Number of virtual bones. Each has 12 numbers of an affine transform.
    VirtualBones(usize),
}

/// Elements of a motion vector that a network reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum MotionElements {
    /// Local joint rotations, and the vertical in the root's frame.
    Pose,
    /// All elements.
    All,
}

/// Sizes of the paper's ablation without a field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GlobalFeatureSettings {
    /// Categorical encoder of the motion.
    pub(crate) encoder: EncoderConfig,
    /// Width of the hidden layer between the garment's coefficients and its feature.
    pub(crate) hidden: usize,
    /// Width of the feature.
    pub(crate) width: usize,
}

/// Age of the previous frame at any usual frame rate, seconds.
const FRAME_BEFORE_S: f32 = 0.001;

impl ComparisonConfig {
    /// Returns the settings of a method.
    ///
    /// Their widths give 220 to 260 thousand parameters on a skeleton of 24 joints. Preset
    /// `standard` has 259 thousand.
    pub(crate) fn of(kind: ComparisonKind) -> Self {
        match kind {
            ComparisonKind::PoseOnly => pose_only(),
            ComparisonKind::VirtualBones => virtual_bones(),
            ComparisonKind::GlobalFeature => global_feature(),
        }
    }

    /// Reads complete settings.
    ///
    /// # Errors
    /// Missing or unknown keys, values of another type or out of range.
    pub(crate) fn from_toml(text: &str) -> Result<Self, SettingsError> {
        let config: Self = toml::from_str(text)?;
        config.check()?;
        Ok(config)
    }

    /// Returns the settings as TOML, which [`ComparisonConfig::from_toml`] reads.
    pub(crate) fn to_toml(&self) -> String {
        // Writing fails only for maps whose keys are no strings, of which there are none.
        toml::to_string_pretty(self).unwrap_or_default()
    }

    /// Checks the ranges of all values.
    ///
    /// # Errors
    /// The first value out of range.
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        let (SpaceSettings::Components(dimensions) | SpaceSettings::VirtualBones(dimensions)) = self.space;
        let feature = self.global_feature.iter();
        let widths = feature.flat_map(|g| {
            let e = &g.encoder;
            e.hidden
                .iter()
                .copied()
                .chain([e.channels, e.categories, g.hidden, g.width])
        });
        let counts = [("space", dimensions), ("frames", self.frames)].into_iter();
        let counts = counts
            .chain(self.hidden.iter().map(|w| ("hidden", *w)))
            .chain(widths.map(|w| ("global_feature", w)));
        for (what, found) in counts {
            ensure(what, "1 to 4096", found, (1..=4096).contains(&found))?;
        }
        let optimiser = &self.optimiser;
        let epochs = optimiser.epochs.map_or("none".to_owned(), |e| e.to_string());
        ensure("optimiser.epochs", "absent", epochs, optimiser.epochs.is_none())?;
        let products = optimiser.products;
        ensure(
            "optimiser.products",
            "f32",
            format!("{products:?}"),
            products == Products::F32,
        )?;
        // In other layouts the vertical is no row of the root's orientation.
        ensure(
            "layout",
            "heading where the pose alone is read",
            format!("{:?}", self.layout),
            self.reads == MotionElements::All || self.layout == MotionLayout::Heading,
        )?;
        if let Some(feature) = &self.global_feature {
            let code = feature.encoder.code;
            ensure(
                "global_feature.encoder.code",
                "picked_logit",
                format!("{code:?}"),
                code == LatentCode::PickedLogit,
            )?;
        }
        ensure("lags_s", "one at least", "none", !self.lags_s.is_empty())?;
        for &lag in &self.lags_s {
            ensure("lags_s", "0 to 10 seconds", lag, (0.0..=10.0).contains(&lag))?;
        }
        for (what, found) in [("dropout", self.dropout), ("input_dropout", self.input_dropout)] {
            ensure(what, "at least 0 and below 1", found, (0.0..1.0).contains(&found))?;
        }
        let (steps, rate) = (self.optimiser.steps, self.optimiser.learning_rate);
        ensure("optimiser.steps", "1 or more", steps, steps > 0)?;
        let is_positive = rate > 0.0 && rate.is_finite();
        ensure("optimiser.learning_rate", "above 0", rate, is_positive)
    }
}

/// Returns an error where a value is out of its range.
fn ensure(
    what: &'static str,
    expected: &'static str,
    found: impl ToString,
    holds: bool,
) -> Result<(), SettingsError> {
    let found = || found.to_string();
    holds.then_some(()).ok_or_else(|| SettingsError::Value {
        what,
        expected,
        found: found(),
    })
}

/// Settings of [`ComparisonKind::PoseOnly`], which the others start from.
fn pose_only() -> ComparisonConfig {
    ComparisonConfig {
        seed: 1,
        layout: MotionLayout::Heading,
        velocity: VelocityScheme::Backward,
        surface: SurfaceKind::Displacement,
        space: SpaceSettings::Components(unic_eval::baselines::COMPONENTS),
        reads: MotionElements::Pose,
        lags_s: vec![0.0],
        hidden: vec![416, 416],
        global_feature: None,
        dropout: 0.2,
        input_dropout: 0.2,
        mirror: true,
        frames: 256,
        optimiser: OptimiserConfig {
            steps: 3000,
            epochs: None,
            learning_rate: 1e-3,
            final_learning_rate: 1e-6,
            half_periods: 1.0,
            warmup: 1.0 / 30.0,
            weight_decay: 1e-2,
            clip_norm: 1.0,
            products: Products::F32,
        },
    }
}

/// Settings of [`ComparisonKind::VirtualBones`].
fn virtual_bones() -> ComparisonConfig {
    ComparisonConfig {
        space: SpaceSettings::VirtualBones(32),
        reads: MotionElements::All,
        lags_s: vec![0.0, FRAME_BEFORE_S, 0.1, 0.23, 0.5],
        hidden: vec![128, 128],
        ..pose_only()
    }
}

/// Settings of [`ComparisonKind::GlobalFeature`].
fn global_feature() -> ComparisonConfig {
    ComparisonConfig {
        space: SpaceSettings::Components(128),
        reads: MotionElements::All,
        lags_s: vec![0.0, FRAME_BEFORE_S],
        hidden: vec![384],
        global_feature: Some(GlobalFeatureSettings {
            encoder: EncoderConfig {
                hidden: vec![128],
                channels: 32,
                categories: 8,
                code: LatentCode::PickedLogit,
            },
            hidden: 128,
            width: 64,
        }),
        dropout: 0.25,
        input_dropout: 0.25,
        ..pose_only()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_toml() {
        for kind in [
            ComparisonKind::PoseOnly,
            ComparisonKind::VirtualBones,
            ComparisonKind::GlobalFeature,
        ] {
            let config = ComparisonConfig::of(kind);
            assert_eq!(ComparisonConfig::from_toml(&config.to_toml()).unwrap(), config);
        }
    }

    #[test]
    fn values_out_of_range_are_named() {
        let refused = |change: &dyn Fn(&mut ComparisonConfig)| {
            let mut config = ComparisonConfig::of(ComparisonKind::GlobalFeature);
            change(&mut config);
            config.check().unwrap_err().to_string()
        };
        assert!(refused(&|c| c.space = SpaceSettings::VirtualBones(0)).contains("space"));
        assert!(refused(&|c| c.lags_s = vec![]).contains("lags_s"));
        assert!(refused(&|c| c.lags_s = vec![f32::NAN]).contains("lags_s"));
        assert!(refused(&|c| c.dropout = 1.0).contains("dropout"));
        assert!(refused(&|c| c.optimiser.steps = 0).contains("optimiser.steps"));
        assert!(refused(&|c| c.global_feature.as_mut().unwrap().width = 0).contains("global_feature"));
    }
}
