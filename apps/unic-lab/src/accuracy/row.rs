//! Rows of the benchmark: training settings with a title.

use crate::comparison::{ComparisonConfig, ComparisonKind};
use anyhow::{Context, Result, anyhow};
use clap::ValueEnum;
use serde::Deserialize;
use std::{fs, path::Path};
use toml::Table;
use unic_cli::{args::PresetName, failure::Usage, settings};
use unic_train::{Refit, TrainConfig};

/// Name and settings file of each built-in row, in the order of the table.
const BUILT_IN: [(&str, &str); 22] = [
    ("pose_only", include_str!("../../rows/pose_only.toml")),
    ("virtual_bones", include_str!("../../rows/virtual_bones.toml")),
    ("standard", include_str!("../../rows/standard.toml")),
    (
        "standard_no_field",
        include_str!("../../rows/standard_no_field.toml"),
    ),
    (
        "standard_no_prior",
        include_str!("../../rows/standard_no_prior.toml"),
    ),
    (
        "standard_no_recurrence",
        include_str!("../../rows/standard_no_recurrence.toml"),
    ),
    (
        "standard_no_swing",
        include_str!("../../rows/standard_no_swing.toml"),
    ),
    (
        "standard_no_memory",
        include_str!("../../rows/standard_no_memory.toml"),
    ),
    (
        "standard_teacher_forcing",
        include_str!("../../rows/standard_teacher_forcing.toml"),
    ),
    (
        "standard_no_noise",
        include_str!("../../rows/standard_no_noise.toml"),
    ),
    (
        "standard_no_mirror",
        include_str!("../../rows/standard_no_mirror.toml"),
    ),
    (
        "standard_no_dropout",
        include_str!("../../rows/standard_no_dropout.toml"),
    ),
    (
        "standard_no_average",
        include_str!("../../rows/standard_no_average.toml"),
    ),
    (
        "standard_no_intersection",
        include_str!("../../rows/standard_no_intersection.toml"),
    ),
    ("paper", include_str!("../../rows/paper.toml")),
    (
        "paper_no_picking",
        include_str!("../../rows/paper_no_picking.toml"),
    ),
    ("paper_one_hot", include_str!("../../rows/paper_one_hot.toml")),
    ("paper_heading", include_str!("../../rows/paper_heading.toml")),
    (
        "paper_root_relative",
        include_str!("../../rows/paper_root_relative.toml"),
    ),
    ("paper_no_field", include_str!("../../rows/paper_no_field.toml")),
    (
        "paper_no_intersection",
        include_str!("../../rows/paper_no_intersection.toml"),
    ),
    ("global_feature", include_str!("../../rows/global_feature.toml")),
];

/// Row of the benchmark.
#[derive(Clone, Debug)]
pub(super) struct RowSettings {
    /// Name of the row, and of its folder.
    pub(super) name: String,
    /// Title in the table.
    pub(super) title: String,
    /// Settings of the training: the row's own over those of a preset or kind. The job sets the
    /// seed.
    pub(super) training: Training,
}

/// Training of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Training {
    /// Model of this project.
    Model(Box<TrainConfig>),
    /// Network of another method.
    Network(Box<ComparisonConfig>),
}

impl Training {
    /// Returns the settings as TOML.
    pub(super) fn to_toml(&self) -> String {
        match self {
            Self::Model(config) => config.to_toml(),
            Self::Network(config) => config.to_toml(),
        }
    }
}

/// Settings file of a row. Other keys are settings of [`TrainConfig`] or [`ComparisonConfig`].
#[derive(Deserialize)]
struct RowFile {
    /// Title in the table.
    title: Option<String>,
    /// Preset of a model.
    preset: Option<String>,
    /// Kind of a network of another method.
    kind: Option<ComparisonKind>,
    /// Keys of the preset to remove.
    #[serde(default)]
    remove: Vec<String>,
    #[serde(flatten)]
    settings: Table,
}

impl RowSettings {
    /// Reads the rows asked for, or all built-in ones.
    pub(super) fn read_all(asked: &[String]) -> Result<Vec<Self>> {
        let built_in = BUILT_IN.iter().map(|(name, text)| Self::parse(name, text));
        let rows: Vec<Self> = match asked {
            [] => built_in.collect::<Result<_>>()?,
            names => names.iter().map(|name| Self::read(name)).collect::<Result<_>>()?,
        };
        for (i, row) in rows.iter().enumerate() {
            if rows[..i].iter().any(|before| before.name == row.name) {
                let name = &row.name;
                return Err(Usage(format!(
                    "--rows: expected rows of different names, found {name} twice"
                ))
                .into());
            }
        }
        Ok(rows)
    }

    /// Reads a built-in row or a settings file.
    fn read(asked: &str) -> Result<Self> {
        if let Some((name, text)) = BUILT_IN.iter().find(|(name, _)| *name == asked) {
            return Self::parse(name, text);
        }
        let path = Path::new(asked);
        let name = path.file_stem().filter(|_| asked.ends_with(".toml"));
        let Some(name) = name else {
            let known: Vec<&str> = BUILT_IN.iter().map(|(name, _)| *name).collect();
            let known = known.join(", ");
            return Err(Usage(format!(
                "--rows: expected a .toml file or one of {known}, found {asked}"
            ))
            .into());
        };
        let text = fs::read_to_string(path).map_err(|e| anyhow!("{asked}: cannot read the settings: {e}"))?;
        Self::parse(&name.to_string_lossy(), &text).with_context(|| asked.to_owned())
    }

    /// Parses the settings of a row.
    fn parse(name: &str, text: &str) -> Result<Self> {
        let file: RowFile = toml::from_str(text)?;
        Ok(Self {
            name: name.to_owned(),
            title: file.title.clone().unwrap_or_else(|| name.to_owned()),
            training: file.training()?,
        })
    }
}

impl RowFile {
    /// Lays the settings over those of the preset or kind.
    fn training(self) -> Result<Training> {
        match (self.preset, self.kind) {
            (Some(preset), None) => {
                let preset = PresetName::from_str(&preset, false)
                    .map_err(|_| anyhow!("expected preset paper, standard or tiny, found {preset}"))?;
                let base = TrainConfig::preset(preset.into());
                let text = settings::merged_toml(&base, self.settings, &self.remove)?;
                let mut config = TrainConfig::from_toml(&text)?;
                // Test clips measure every row, so that no training clip is held out for that. A
                // preset that trains twice keeps its first fit, which chooses the weight of the
                // field.
                if config.validation.refit == Refit::Never {
                    config.validation.refit = Refit::Only;
                }
                Ok(Training::Model(Box::new(config)))
            }
            (None, Some(kind)) => {
                let text = settings::merged_toml(&ComparisonConfig::of(kind), self.settings, &self.remove)?;
                Ok(Training::Network(Box::new(ComparisonConfig::from_toml(&text)?)))
            }
            (preset, kind) => Err(anyhow!(
                "expected a preset or the kind of another network, found {}",
                if preset.is_some() && kind.is_some() {
                    "both"
                } else {
                    "neither"
                }
            )),
        }
    }
}

/// Returns the names and titles of the built-in rows.
pub(super) fn list() -> String {
    let title =
        |name: &str, text: &str| RowSettings::parse(name, text).map_or_else(|e| e.to_string(), |r| r.title);
    let line = |(name, text): &(&str, &str)| format!("{name:<26}{}\n", title(name, text));
    BUILT_IN.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_train::StateSettings;

    #[test]
    fn built_in_rows_differ_from_each_other() {
        let rows = RowSettings::read_all(&[]).unwrap();
        for (i, a) in rows.iter().enumerate() {
            for b in &rows[..i] {
                assert!(a.training != b.training, "{} and {}", a.name, b.name);
            }
        }
        let removed = rows
            .iter()
            .find(|row| row.name == "standard_no_recurrence")
            .unwrap();
        let Training::Model(config) = &removed.training else {
            unreachable!("a preset's row trains a model");
        };
        let StateSettings::Displacement { recurrence, .. } = &config.model.state else {
            unreachable!("standard's state is a displacement");
        };
        assert!(recurrence.is_none());
    }

    #[test]
    fn unknown_settings_are_refused() {
        let parse = |text: &str| RowSettings::parse("row", text).unwrap_err().to_string();
        assert!(parse("preset = 'new'").contains("new"));
        assert!(parse("preset = 'tiny'\nremove = ['model.nothing']").contains("model.nothing"));
        assert!(parse("preset = 'tiny'\n[optimiser]\nstepz = 3").contains("stepz"));
        assert!(parse("kind = 'magic'").contains("magic"));
        assert!(parse("kind = 'pose_only'\ncomponents = 3").contains("components"));
        assert!(parse("kind = 'pose_only'\npreset = 'tiny'").contains("both"));
        assert!(parse("title = 'nothing'").contains("neither"));
        assert!(
            RowSettings::read("no_such_row")
                .unwrap_err()
                .to_string()
                .contains("standard_no_field")
        );
    }
}
