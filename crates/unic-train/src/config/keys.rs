//! Dotted keys of the settings, for those who mistype one.

use super::{Preset, SettingsError, TrainConfig};
use std::collections::BTreeSet;

/// Keys that no preset has: they are optional.
const OPTIONAL: [&str; 2] = ["motion_seconds", "optimiser.epochs"];

/// Names that differ by more are not each other's slips.
const LIKE: f64 = 0.6;

/// The error of a key that no settings have, with the one that it is most like; none for a key that
/// there is.
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
    fn every_key_is_known_and_slips_find_theirs() {
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
            let told = unknown(slip).map_or_else(String::new, |e| e.to_string());
            assert!(
                told.contains(&format!("`{meant}`")) && told.contains(&format!("`{slip}`")),
                "{told}"
            );
        }
        let told = unknown("qqqq").map_or_else(String::new, |e| e.to_string());
        assert!(told.contains("unknown key `qqqq`"), "{told}");
    }
}
