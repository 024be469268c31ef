//! Previews of a training: the models of its validations, for a window.

use std::sync::{Arc, mpsc::Sender};
use unic_core::Model;
use unic_io::Capture;
use unic_train::{Dataset, Fit};

/// News of a training for a window.
// Without the viewer nothing reads the news.
#[cfg_attr(not(feature = "viewer"), allow(dead_code, reason = "a window reads them"))]
pub(super) enum News {
    /// The clips are loaded.
    Begun {
        /// Capture that is trained on.
        capture: Box<Capture>,
        /// Clip that is held out; none in a fit on all clips.
        clip: Option<String>,
    },
    /// A validation has begun.
    Model {
        /// Steps done so far.
        step: u64,
        /// Model that is measured.
        model: Arc<Model>,
    },
    /// A sentence to show.
    Message(String),
    /// The training is interrupted, so the window closes.
    Interrupted,
}

/// Sender of news. A window that is closed receives none, which does not concern the training.
#[cfg_attr(not(feature = "viewer"), allow(dead_code, reason = "a window makes it"))]
#[derive(Clone)]
pub(super) struct Preview(pub(super) Sender<News>);

impl Preview {
    /// Tells which clip is held out.
    pub(super) fn begin(&self, data: &Dataset) {
        self.send(News::Begun {
            capture: Box::new(data.capture.clone()),
            clip: data.validation.first().map(|clip| clip.name().to_owned()),
        });
    }

    /// Shows a model of the fit that holds clips out.
    pub(super) fn model(&self, fit: Fit, step: u64, model: &Arc<Model>) {
        if fit == Fit::HeldOut {
            self.send(News::Model {
                step,
                model: Arc::clone(model),
            });
        }
    }

    pub(super) fn send(&self, news: News) {
        let _ = self.0.send(news);
    }
}
