//! Dotted keys of the settings, and suggestions for misspelt ones.

use super::{Preset, SettingsError, TrainConfig};
use std::collections::BTreeSet;

/// Keys that no preset has: they are optional.
const OPTIONAL: [&str; 2] = ["motion_seconds", "optimiser.epochs"];

/// Smallest similarity at which a known key is suggested for a misspelt one.
const LIKE: f64 = 0.6;

/// Returns the error of an unknown key, with the most similar known one. Returns none for a known
/// key.
pub(super) fn unknown(key: &str) -> Option<SettingsError> {
    let known = all();
    if known.contains(key) {
        return None;
    }
    let like =
        |other: &String| strsim::jaro_winkler(key, other).max(strsim::jaro_winkler(last(key), last(other)));
    let nearest = known.iter().max_by(|a, b| {
        let whole = |other: &String| strsim::normalized_damerau_levenshtein(key, other);
        (like(a) + whole(a)).total_cmp(&(like(b) + whole(b)))
    });
    Some(SettingsError::UnknownKey {
        key: key.to_owned(),
        nearest: nearest.filter(|nearest| like(nearest) > LIKE).cloned(),
    })
}

fn last(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

/// The keys of all presets, of tables and of values.
fn all() -> BTreeSet<String> {
    let mut keys: BTreeSet<String> = OPTIONAL.map(str::to_owned).into();
    for preset in Preset::ALL {
        if let Ok(table) = toml::Table::try_from(TrainConfig::preset(preset)) {
            collect(&table, "", &mut keys);
        }
    }
    keys
}

fn collect(table: &toml::Table, above: &str, keys: &mut BTreeSet<String>) {
    for (key, value) in table {
        let key = format!("{above}{key}");
        if let toml::Value::Table(below) = value {
            collect(below, &format!("{key}."), keys);
        }
        keys.insert(key);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspelt_keys_get_the_nearest_key_as_suggestion() {
        assert!(all().len() > 40);
        for key in all() {
            assert!(unknown(&key).is_none(), "{key}");
        }
        for (slip, meant) in [
            ("optimiser.step", "optimiser.steps"),
            ("optimizer.steps", "optimiser.steps"),
            ("steps", "optimiser.steps"),
            ("batch.window", "batch.windows"),
            ("learning_rate", "optimiser.learning_rate"),
            ("loss.positions", "loss.position"),
        ] {
            let message = unknown(slip).map_or_else(String::new, |e| e.to_string());
            assert!(
                message.contains(&format!("`{meant}`")) && message.contains(&format!("`{slip}`")),
                "{message}"
            );
        }
        let message = unknown("qqqq").map_or_else(String::new, |e| e.to_string());
        assert!(message.contains("unknown key `qqqq`"), "{message}");
    }
}
