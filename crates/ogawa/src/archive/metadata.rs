//! Metadata of archives, objects and properties.

use std::sync::Arc;

/// Pairs of keys and values, stored as `key=value;key=value`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Metadata(Arc<str>);

impl Metadata {
    /// Metadata with the text of a file.
    pub fn new(text: &str) -> Self {
        Self(text.into())
    }

    /// Metadata of several pairs, sorted by key. Keys and values hold neither `=` nor `;`.
    pub fn of(pairs: &[(&str, &str)]) -> Self {
        let mut pairs: Vec<String> = pairs
            .iter()
            .map(|(key, value)| format!("{key}={value}"))
            .collect();
        pairs.sort();
        Self(pairs.join(";").into())
    }

    /// Value of a key, if there is one.
    pub fn get(&self, key: &str) -> Option<&str> {
        let mut pairs = self.0.split(';').filter_map(|pair| pair.split_once('='));
        pairs.find_map(|(k, value)| (k == key).then_some(value))
    }

    /// Text in the file.
    pub fn text(&self) -> &str {
        &self.0
    }
}

impl Default for Metadata {
    fn default() -> Self {
        Self::new("")
    }
}
