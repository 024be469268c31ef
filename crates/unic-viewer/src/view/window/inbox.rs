//! Files that are read, and changes from outside.

use super::{Loader, ViewUpdate};
use crate::view::Source;
use eframe::egui;
use std::panic::{self, AssertUnwindSafe};
use std::path::PathBuf;
use std::sync::{
    Arc,
    mpsc::{Receiver, Sender, channel},
};

/// Change of what is shown.
pub(super) enum Change {
    /// Sources of a name.
    Sources(String, Vec<Source>),
    /// Sentence to show.
    Message(String),
    /// The window closes.
    Close,
}

/// Changes that wait for the window.
pub(super) struct Inbox {
    load: Loader,
    sender: Sender<Change>,
    loaded: Receiver<Change>,
    updates: Option<Receiver<ViewUpdate>>,
}

impl Inbox {
    pub(super) fn new(load: Loader, updates: Option<Receiver<ViewUpdate>>) -> Self {
        let (sender, loaded) = channel();
        Self {
            load,
            sender,
            loaded,
            updates,
        }
    }

    /// Reads a file in a thread of its own, so that the window goes on.
    pub(super) fn load(&self, path: PathBuf, window: &egui::Context) {
        let (load, sender, window) = (Arc::clone(&self.load), self.sender.clone(), window.clone());
        let name = path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned();
        let work = move || {
            // A file that makes a reader panic must not end the window.
            let read = panic::catch_unwind(AssertUnwindSafe(|| load(&path)));
            let change = match read {
                Ok(Ok(sources)) => Change::Sources(name, sources),
                Ok(Err(message)) => Change::Message(message),
                Err(_) => Change::Message(format!(
                    "{name}: expected a file that can be read, found an error in the reader"
                )),
            };
            // The window may be closed by now.
            let _ = sender.send(change);
            window.request_repaint();
        };
        if let Err(error) = std::thread::Builder::new().name("reader".into()).spawn(work) {
            let _ = self
                .sender
                .send(Change::Message(format!("a thread cannot be started: {error}")));
        }
    }

    /// Changes that have come.
    pub(super) fn take(&self) -> Vec<Change> {
        let updates = self
            .updates
            .iter()
            .flat_map(Receiver::try_iter)
            .map(|update| match update {
                ViewUpdate::Model(model) => Change::Sources(model.name.clone(), vec![Source::Model(model)]),
                ViewUpdate::Message(message) => Change::Message(message),
                ViewUpdate::Close => Change::Close,
            });
        self.loaded.try_iter().chain(updates).collect()
    }
}
