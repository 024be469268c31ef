//! Settings as TOML, whole and one key at a time.

use super::{SettingsError, TrainConfig, keys};

impl TrainConfig {
    /// These settings with `key=value` assignments, keys dotted as in the TOML file.
    ///
    /// # Errors
    /// Assignments without `=`, keys that do not exist, values of another type or out of range.
    pub fn with_assignments(&self, assignments: &[String]) -> Result<Self, SettingsError> {
        let mut table = toml::Table::try_from(self).map_err(|e| SettingsError::Assignment(e.to_string()))?;
        for assignment in assignments {
            let wrong = || SettingsError::Assignment(assignment.clone());
            let (key, value) = assignment.split_once('=').ok_or_else(wrong)?;
            let value = parse_value(value.trim());
            let key = key.trim();
            assign(&mut table, key, value).ok_or_else(|| keys::unknown(key).unwrap_or_else(wrong))?;
        }
        // The last assignment of steps or epochs takes effect.
        let last = |key: &str| {
            let key_of = |a: &String| a.split('=').next().map(str::trim) == Some(key);
            assignments.iter().rposition(key_of)
        };
        if last("optimiser.steps") > last("optimiser.epochs") {
            remove_epochs(&mut table);
        }
        let config: Self = table.try_into().map_err(|error: toml::de::Error| {
            let keys = assignments
                .iter()
                .filter_map(|a| Some(a.split_once('=')?.0.trim()));
            let unknown = keys.filter_map(keys::unknown).next();
            unknown.unwrap_or(SettingsError::Toml(error))
        })?;
        config.check()?;
        Ok(config)
    }

    /// Reads a complete settings file.
    ///
    /// # Errors
    /// Missing or unknown keys, values of another type or out of range.
    pub fn from_toml(text: &str) -> Result<Self, SettingsError> {
        let config: Self = toml::from_str(text)?;
        config.check()?;
        Ok(config)
    }

    /// The settings as a file that [`TrainConfig::from_toml`] reads.
    pub fn to_toml(&self) -> String {
        // Writing fails only for maps whose keys are not strings, and there are none.
        toml::to_string_pretty(self).unwrap_or_default()
    }
}

/// Parses a TOML value. Other text becomes a string: `validation.refit=never` needs no quotes.
fn parse_value(text: &str) -> toml::Value {
    let document: Result<toml::Table, _> = toml::from_str(&format!("value = {text}"));
    let value = document.ok().and_then(|mut table| table.remove("value"));
    value.unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

/// Removes `optimiser.epochs`, so that `optimiser.steps` counts.
fn remove_epochs(settings: &mut toml::Table) {
    let optimiser = settings.get_mut("optimiser").and_then(toml::Value::as_table_mut);
    optimiser.and_then(|optimiser| optimiser.remove("epochs"));
}

fn assign(table: &mut toml::Table, key: &str, value: toml::Value) -> Option<()> {
    match key.split_once('.') {
        Some((head, rest)) => assign(table.get_mut(head)?.as_table_mut()?, rest, value),
        None => {
            table.insert(key.to_owned(), value);
            Some(())
        }
    }
}
