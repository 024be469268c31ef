//! Checks of the ranges of settings.

use super::{MOST_CHORD_DEVIATIONS, RecurrenceSettings, StateSettings, TrainConfig};
use thiserror::Error;
use unic_core::{config::ProjectionConfig, printable::printable_excerpt};

/// Settings that no run can be made from.
#[derive(Debug, Error)]
pub enum SettingsError {
    /// Text that is not TOML, or TOML with other keys or types than the settings.
    #[error("training settings: {}", printable_excerpt(&in_one_line(.0)))]
    Toml(#[from] toml::de::Error),
    /// Assignment that is not of the form `key=value`.
    #[error("expected key=value with a dotted key such as optimiser.steps=1000, found `{}`", printable_excerpt(.0))]
    Assignment(String),
    /// A key that no settings have.
    #[error(
        "training settings: expected a key that there is, found the unknown key `{}`{}",
        printable_excerpt(key),
        meant(nearest)
    )]
    UnknownKey {
        /// The key as it was given.
        key: String,
        /// The most similar known key.
        nearest: Option<String>,
    },
    /// A value out of range.
    #[error(
        "training settings: {what} must be {expected}, found {}",
        printable_excerpt(found)
    )]
    Value {
        /// Dotted key.
        what: &'static str,
        /// Allowed values.
        expected: &'static str,
        /// Actual value.
        found: String,
    },
}

fn meant(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map_or_else(String::new, |key| format!("; did you mean `{key}`?"))
}

/// Formats the message and position of an error in one line, without the quoted source line.
fn in_one_line(error: &toml::de::Error) -> String {
    let text = error.to_string();
    let is_picture = |line: &&str| {
        line.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' ')
            .starts_with('|')
    };
    text.lines()
        .filter(|line| !is_picture(line))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Most vertices that a step may roll out, every frame of every window counted: three times the
/// published batch of 1.2 million. The paper's field keeps 8 KB a vertex for the backward pass.
const MOST_VERTEX_FRAMES: usize = 1 << 22;

impl TrainConfig {
    /// Checks that every value is within its range.
    ///
    /// # Errors
    /// The first value out of range.
    pub fn check(&self) -> Result<(), SettingsError> {
        let o = &self.optimiser;
        self.check_batch()?;
        if let StateSettings::Displacement {
            recurrence: Some(recurrence),
            ..
        } = &self.model.state
        {
            recurrence.check()?;
        }
        for (what, found) in [
            ("optimiser.steps", o.steps),
            ("validation.every", self.validation.every),
        ] {
            ensure(what, "1 or more", found, found > 0)?;
        }
        if let Some(epochs) = o.epochs {
            ensure("optimiser.epochs", "1 or more", epochs, epochs > 0)?;
        }
        if let Some(seconds) = self.motion_seconds {
            ensure("motion_seconds", "above 0", seconds, is_positive(seconds))?;
        }
        let rate = o.learning_rate;
        ensure("optimiser.learning_rate", "above 0", rate, is_positive(rate))?;
        if let Some(limit) = self.model.normalisation.limit {
            ensure(
                "model.normalisation.limit",
                "above 0",
                limit,
                is_positive(limit.into()),
            )?;
        }
        for spring in &self.model.springs {
            let found = format!("{} Hz and {}", spring.frequency_hz, spring.damping_ratio);
            let expected = "0.01 to 100 Hz and damping ratios of 0.01 to 0.99";
            ensure("model.springs", expected, found, spring.is_usable())?;
        }
        for (what, found) in self.amounts() {
            // NaN fails the comparison, infinity the second condition.
            ensure(what, "0 or more", found, found >= 0.0 && found.is_finite())?;
        }
        for (what, found) in self.shares() {
            // A range contains no NaN.
            ensure(what, "at least 0 and below 1", found, (0.0..1.0).contains(&found))?;
        }
        let shapes = self.replay.shapes;
        ensure("replay.shapes", "1 to 1024", shapes, (1..=1024).contains(&shapes))?;
        self.check_sizing()?;
        self.check_projection()
    }

    fn check_sizing(&self) -> Result<(), SettingsError> {
        for size in &self.sizing.sizes {
            let is_size = size
                .iter()
                .zip([4096, 64])
                .all(|(n, most)| (1..=most).contains(n));
            ensure(
                "a size of sizing.sizes",
                "a width of 1 to 4096 and 1 to 64 layers",
                format!("{size:?}"),
                is_size,
            )?;
        }
        // Checkpoints of a trial are named by its size, and budgets leave out the last sizes.
        let cost = |[width, layers]: &[usize; 2]| width * width * layers;
        let rises = self.sizing.sizes.is_sorted_by(|a, b| cost(a) < cost(b));
        ensure(
            "sizing.sizes",
            "from small to large, each once",
            format!("{:?}", self.sizing.sizes),
            rises,
        )?;
        Ok(())
    }

    fn check_projection(&self) -> Result<(), SettingsError> {
        let p = &self.projection;
        let bending = "projection.bending";
        ensure(bending, "one value or more", "none", !p.bending.is_empty())?;
        for &share in &p.bending {
            ensure(bending, "0 to 1", share, (0.0..=1.0).contains(&share))?;
        }
        ensure(
            "projection.order",
            "one value or more",
            "none",
            !p.order.is_empty(),
        )?;
        for &value in &p.order {
            let is_order = ProjectionConfig::is_order(value);
            ensure("projection.order", "0, or 0.05 to 1", value, is_order)?;
        }
        let (chords, count) = ("projection.chord_deviations", p.chord_deviations.len());
        ensure(chords, "one value or more", "none", count > 0)?;
        for &value in &p.chord_deviations {
            let is_in_range = (0.0..=MOST_CHORD_DEVIATIONS).contains(&value);
            ensure(chords, "0 to 1.5", value, is_in_range)?;
        }
        let is_layers = ProjectionConfig::is_layers(p.layers);
        ensure("projection.layers", "0 to 0.5", p.layers, is_layers)?;
        for (what, found) in [
            ("projection.coarse_sweeps", p.coarse_sweeps),
            ("projection.sweeps", p.sweeps),
            ("projection.bending_sweeps", p.bending_sweeps),
        ] {
            ensure(what, "up to 1000", found, found <= ProjectionConfig::MOST_SWEEPS)?;
        }
        for (what, found) in [
            ("projection.pull_s", p.pull_s),
            ("projection.carry_s", p.carry_s),
            ("projection.radius_m", p.radius_m),
        ] {
            ensure(what, "above 0", found, is_positive(found.into()))?;
        }
        Ok(())
    }

    fn check_batch(&self) -> Result<(), SettingsError> {
        let b = &self.batch;
        let counts = [
            ("batch.windows", "1 to 65536", b.windows, 1 << 16),
            ("batch.points", "1 to 1048576", b.points, 1 << 20),
            ("batch.unroll_first", "1 to 1024", b.unroll_first, 1 << 10),
            ("batch.unroll_last", "1 to 1024", b.unroll_last, 1 << 10),
        ];
        for (what, expected, found, most) in counts {
            ensure(what, expected, found, (1..=most).contains(&found))?;
        }
        let frames = b.unroll_first.max(b.unroll_last);
        // Saturating: the product of three values in range may exceed 32 bits.
        let product = b.windows.saturating_mul(b.points).saturating_mul(frames);
        ensure(
            "the product of batch.windows, batch.points and the longer batch.unroll",
            "4194304 or less, so that a step fits in memory",
            product,
            product <= MOST_VERTEX_FRAMES,
        )
    }

    /// Returns the values that may be any finite number from 0 on, with their keys.
    fn amounts(&self) -> [(&'static str, f64); 15] {
        let (o, r) = (&self.optimiser, &self.regularisation);
        let (memory_s, excursion_m) = match self.model.state {
            StateSettings::RootRelative => (0.0, 0.0),
            StateSettings::Displacement {
                memory_s,
                excursion_m,
                ..
            } => (memory_s, excursion_m),
        };
        [
            (
                "model.normalisation.least_std",
                self.model.normalisation.least_std.into(),
            ),
            ("model.state.displacement.memory_s", memory_s.into()),
            ("model.state.displacement.excursion_m", excursion_m.into()),
            ("optimiser.final_learning_rate", o.final_learning_rate),
            ("optimiser.half_periods", o.half_periods),
            ("optimiser.weight_decay", o.weight_decay.into()),
            ("optimiser.clip_norm", o.clip_norm),
            ("batch.unroll_grown", self.batch.unroll_grown),
            ("regularisation.state_noise_m", r.state_noise_m.into()),
            ("loss.position", self.loss.position.into()),
            ("intersection.relaxation_m", self.intersection.relaxation_m.into()),
            ("intersection.margin_m", self.intersection.margin_m.into()),
            ("projection.deviations", self.projection.deviations.into()),
            ("replay.deviation", self.replay.deviation.into()),
            ("replay.cost", self.replay.cost.into()),
        ]
    }

    fn shares(&self) -> [(&'static str, f64); 4] {
        let r = &self.regularisation;
        [
            ("regularisation.dropout", r.dropout.into()),
            ("regularisation.input_dropout", r.input_dropout.into()),
            ("regularisation.average", r.average),
            ("optimiser.warmup", self.optimiser.warmup),
        ]
    }
}

impl RecurrenceSettings {
    fn check(&self) -> Result<(), SettingsError> {
        const KEYS: [&str; 4] = [
            "model.state.displacement.recurrence.oscillators",
            "model.state.displacement.recurrence.width",
            "model.state.displacement.recurrence.windows",
            "model.state.displacement.recurrence.frames",
        ];
        let counts = [self.oscillators, self.width, self.windows, self.frames];
        for (what, found) in KEYS.into_iter().zip(counts) {
            ensure(what, "1 to 4096", found, (1..=4096).contains(&found))?;
        }
        // No overflow: each factor is at most 4096 here.
        ensure(
            "the product of model.state.displacement.recurrence.windows and its frames",
            "65536 or less",
            self.windows * self.frames,
            self.windows * self.frames <= 1 << 16,
        )?;
        let (steps, rate) = (self.steps, self.learning_rate);
        ensure(
            "model.state.displacement.recurrence.epochs",
            "1 to 1000000",
            self.epochs,
            (1..=1_000_000).contains(&self.epochs),
        )?;
        ensure(
            "model.state.displacement.recurrence.dropout",
            "0 to below 1",
            self.dropout,
            (0.0..1.0).contains(&self.dropout),
        )?;
        ensure(
            "model.state.displacement.recurrence.swing",
            "0 to 1",
            self.swing,
            (0.0..=1.0).contains(&self.swing),
        )?;
        ensure(
            "model.state.displacement.recurrence.steps",
            "1 or more",
            steps,
            steps > 0,
        )?;
        ensure(
            "model.state.displacement.recurrence.learning_rate",
            "above 0",
            rate,
            is_positive(rate),
        )
    }
}

fn is_positive(amount: f64) -> bool {
    amount > 0.0 && amount.is_finite()
}

fn ensure(
    what: &'static str,
    expected: &'static str,
    found: impl std::fmt::Display,
    holds: bool,
) -> Result<(), SettingsError> {
    if holds {
        return Ok(());
    }
    let found = found.to_string();
    Err(SettingsError::Value {
        what,
        expected,
        found,
    })
}
