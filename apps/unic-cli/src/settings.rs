//! Training settings of a command line: preset, settings file and single settings.

use crate::{
    args::{PresetName, TrainArgs},
    failure::{Usage, one_line},
};
use anyhow::{Result, anyhow};
use serde::Serialize;
use std::{fs, path::Path};
use toml::{Table, Value};
use unic_train::TrainConfig;

/// Returns the settings of a new run: the preset, then `--config`, then `--set`, `--seed`,
/// `--steps`.
///
/// # Errors
/// A settings file that cannot be read, unknown settings or values out of range.
pub(crate) fn of_new_run(args: &TrainArgs) -> Result<TrainConfig> {
    let preset = args.preset.unwrap_or(PresetName::Standard);
    overlaid(args, TrainConfig::preset(preset.into()))
}

/// Returns the settings of a resumed run, whose settings file at `path` holds `stored`.
///
/// The command line may repeat the settings, lengthen the same schedule and change
/// `optimiser.products`.
///
/// # Errors
/// The first setting that the command line changes in another way.
pub(crate) fn of_resumed_run(args: &TrainArgs, stored: TrainConfig, path: &Path) -> Result<TrainConfig> {
    let mut asked = overlaid(args, stored.clone())?;
    let stored = stored.with_products_of(&asked);
    if asked.optimiser.epochs.is_some() && asked.optimiser.epochs == stored.optimiser.epochs {
        // Steps follow from epochs and the capture. A file from elsewhere may hold those of another
        // capture.
        asked.optimiser.steps = stored.optimiser.steps;
    }
    if stored.is_lengthened_by(&asked) {
        return Ok(asked);
    }
    let (old, new) = (table(&stored)?, table(&asked)?);
    let Some(Difference { key, old, new }) = first_difference(&old, &new) else {
        return Ok(stored);
    };
    let path = path.display();
    let longer = match key.as_str() {
        "optimiser.epochs" | "optimiser.steps" => {
            "; a run of one fit can be made longer if optimiser.half_periods grows by the same factor"
        }
        _ => "",
    };
    Err(Usage(format!(
        "{path}: expected --resume to keep {key} = {old}, found {new} asked for{longer}"
    ))
    .into())
}

/// Settings of `base`, changed by the settings file and the single settings of the command line.
fn overlaid(args: &TrainArgs, base: TrainConfig) -> Result<TrainConfig> {
    let config = match &args.config {
        Some(path) => with_file(&base, path)?,
        None => base,
    };
    let mut assignments = args.set.clone();
    assignments.extend(args.seed.map(|seed| format!("seed={seed}")));
    assignments.extend(args.steps.map(|steps| format!("optimiser.steps={steps}")));
    Ok(config
        .with_assignments(&assignments)
        .map_err(|e| Usage(one_line(&e.to_string())))?)
}

/// Settings of a file. A partial file is completed by the settings of `base`.
fn with_file(base: &TrainConfig, path: &Path) -> Result<TrainConfig> {
    let failed = |what: String| anyhow!("{}: {}", path.display(), one_line(&what));
    let text = fs::read_to_string(path).map_err(|e| failed(format!("cannot read the settings: {e}")))?;
    // A complete file is not completed by the preset: an optional key that it lacks stays absent.
    if let Ok(config) = TrainConfig::from_toml(&text) {
        return Ok(config);
    }
    let file: Table = toml::from_str(&text).map_err(|e: toml::de::Error| failed(e.to_string()))?;
    let text = merged_toml(base, file, &[]);
    let config = text.and_then(|text| Ok(TrainConfig::from_toml(&text)?));
    config.map_err(|e| failed(e.to_string()))
}

/// Returns TOML text of the settings of `base`, without the dotted keys in `remove`, changed by
/// `file`.
///
/// # Errors
/// A key to remove that `base` lacks.
pub fn merged_toml(base: &impl Serialize, file: Table, remove: &[String]) -> Result<String> {
    let mut all = table(base)?;
    for key in remove {
        if !removed(&mut all, key) {
            return Err(anyhow!("expected a key of the preset to remove, found {key}"));
        }
    }
    let optimiser = file.get("optimiser").and_then(Value::as_table);
    if optimiser.is_some_and(|o| o.contains_key("steps") && !o.contains_key("epochs")) {
        // Epochs determine the number of steps, so a number of steps must replace them.
        removed(&mut all, "optimiser.epochs");
    }
    overlay(&mut all, file);
    Ok(toml::to_string(&all)?)
}

/// Removes a dotted key. False if it does not exist.
fn removed(table: &mut Table, key: &str) -> bool {
    match key.split_once('.') {
        None => table.remove(key).is_some(),
        Some((first, rest)) => {
            let below = table.get_mut(first).and_then(Value::as_table_mut);
            below.is_some_and(|below| removed(below, rest))
        }
    }
}

fn table(config: &impl Serialize) -> Result<Table> {
    Ok(Table::try_from(config)?)
}

/// Copies the values of `over` into `base`, table by table.
fn overlay(base: &mut Table, over: Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(base)), Value::Table(over)) => overlay(base, over),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Setting that differs between two runs.
struct Difference {
    /// Dotted key.
    key: String,
    /// Values in TOML, or "nothing".
    old: String,
    new: String,
}

/// First setting that differs between two tables.
fn first_difference(old: &Table, new: &Table) -> Option<Difference> {
    let text = |value: Option<&Value>| value.map_or("nothing".into(), Value::to_string);
    let keys = old.keys().chain(new.keys().filter(|key| !old.contains_key(*key)));
    keys.filter(|key| old.get(*key) != new.get(*key))
        .find_map(|key| match (old.get(key), new.get(key)) {
            (Some(Value::Table(old)), Some(Value::Table(new))) => {
                let below = first_difference(old, new)?;
                let key = format!("{key}.{}", below.key);
                Some(Difference { key, ..below })
            }
            (old, new) => Some(Difference {
                key: key.clone(),
                old: text(old),
                new: text(new),
            }),
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Args, Command};
    use clap::Parser;

    fn args(line: &str) -> TrainArgs {
        match Args::parse_from(format!("unic train c {line}").split_whitespace()).command {
            Command::Train(args) => args,
            other => unreachable!("{other:?}"),
        }
    }

    #[test]
    fn later_sources_take_precedence() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        fs::write(&path, "seed = 5\n[optimiser]\nsteps = 70\nclip_norm = 2.0\n").unwrap();
        let line = format!(
            "--preset tiny --config {} --set optimiser.clip_norm=3 --steps 80",
            path.display()
        );
        let config = of_new_run(&args(&line.replace("=3 ", "=3.0 "))).unwrap();
        let tiny = TrainConfig::preset(unic_train::Preset::Tiny);
        assert_eq!(
            (config.seed, config.optimiser.steps, config.optimiser.clip_norm),
            (5, 80, 3.0)
        );
        assert_eq!(config.model, tiny.model);
    }

    #[test]
    fn a_complete_file_is_independent_of_the_preset() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        let tiny = TrainConfig::preset(unic_train::Preset::Tiny);
        fs::write(&path, tiny.to_toml()).unwrap();
        assert_eq!(
            of_new_run(&args(&format!("--config {}", path.display()))).unwrap(),
            tiny
        );
        fs::write(&path, "[optimiser]\nstepz = 7\n").unwrap();
        let error = of_new_run(&args(&format!("--config {}", path.display())))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("s.toml") && error.contains("stepz") && !error.contains('\n'),
            "{error}"
        );
    }

    #[test]
    fn a_resumed_run_may_repeat_the_epochs_of_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("full.toml");
        let paper = TrainConfig::preset(unic_train::Preset::Paper);
        fs::write(&path, paper.to_toml()).unwrap();
        let mut stored = paper.clone();
        stored.optimiser.steps = 1088;
        let line = format!("--config {}", path.display());
        let resumed = |line: &str| of_resumed_run(&args(line), stored.clone(), Path::new("config.toml"));
        assert_eq!(resumed(&line).unwrap(), stored);
        let longer = "--set optimiser.epochs=500 --set optimiser.half_periods=5.0";
        assert_eq!(resumed(longer).unwrap().optimiser.epochs, Some(500));
        let error = resumed("--set optimiser.epochs=500").unwrap_err().to_string();
        assert!(error.contains("optimiser.half_periods grows"), "{error}");
    }

    #[test]
    fn a_resumed_run_may_repeat_settings_but_not_change_them() {
        let stored = of_new_run(&args("--preset tiny --steps 40 --seed 3")).unwrap();
        let resumed = |line: &str| of_resumed_run(&args(line), stored.clone(), Path::new("config.toml"));
        assert_eq!(resumed("").unwrap(), stored);
        assert_eq!(resumed("--steps 40 --set batch.points=64").unwrap(), stored);
        assert!(resumed("--steps 80").is_err(), "tiny's windows grow");
        let products = resumed("--set optimiser.products=bf16")
            .unwrap()
            .optimiser
            .products;
        assert_eq!(products, unic_train::Products::Bf16);
        let error = resumed("--seed 3 --set batch.points=9").unwrap_err().to_string();
        assert!(
            error.contains("batch.points = 64") && error.contains("found 9"),
            "{error}"
        );
    }
}
