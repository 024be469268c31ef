//! Statements about what an import has converted or assumed.

use crate::output::print_status;
use std::path::Path;

/// Notes of an import, printed to stderr as they come.
#[derive(Debug, Default)]
pub(super) struct Notes(pub(super) Vec<String>);

impl Notes {
    /// Adds a note about the file `path`.
    pub(super) fn add(&mut self, path: &Path, text: &str) {
        let note = format!("{}: {text}", path.display());
        // One file may be the garment, the character and the motion.
        if !self.0.contains(&note) {
            print_status(&note);
            self.0.push(note);
        }
    }
}
