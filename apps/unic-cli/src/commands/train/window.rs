//! `unic train --view`: the training in a thread of its own, its previews in a window.

use super::{
    TrainingSummary,
    preview::{News, Preview},
    train_previewed,
};
use crate::{
    args::TrainArgs,
    commands::view::{
        loader,
        sources::{Reader, clip_source},
    },
    interrupt,
    output::print_status,
};
use anyhow::{Context, Result};
use std::{
    panic,
    sync::mpsc::{Receiver, Sender, channel},
    thread,
};
use unic_viewer::{ModelSource, Source, ViewSession, ViewSettings, ViewUpdate, view_in_window};

/// Stack of the thread that trains, bytes: as much as a main thread has.
const STACK: usize = 8 << 20;

/// Trains, and shows previews until the window is closed.
///
/// # Errors
/// The errors of [`train`](super::train). A window that cannot be opened is none.
pub(super) fn train(args: &TrainArgs) -> Result<TrainingSummary> {
    let (sender, news) = channel();
    thread::scope(|scope| {
        // Windows belong to the main thread on most systems, so the training gets another one.
        let training = thread::Builder::new().name("training".into()).stack_size(STACK);
        let training = training
            .spawn_scoped(scope, move || train_and_tell(args, Preview(sender)))
            .context("the training: a thread cannot be started")?;
        if let Err(error) = show(news) {
            print_status(&format!("no preview: {error:#}; the training goes on"));
        }
        training
            .join()
            .unwrap_or_else(|payload| panic::resume_unwind(payload))
    })
}

fn train_and_tell(args: &TrainArgs, preview: Preview) -> Result<TrainingSummary> {
    let trained = train_previewed(args, Some(preview.clone()));
    preview.send(match &trained {
        _ if interrupt::is_requested() => News::Interrupted,
        Ok(_) => News::Message("the training is finished; close the window for its summary".into()),
        Err(error) => News::Message(format!("the training has failed: {error:#}")),
    });
    trained
}

/// Opens the window when the clips are loaded. A training that fails before has none.
fn show(news: Receiver<News>) -> Result<()> {
    let Ok(News::Begun { capture, clip }) = news.recv() else {
        return Ok(());
    };
    let clip = clip.context("expected a clip that is held out, found none")?;
    let source = clip_source(&capture, &clip)?;
    let session = ViewSession::new(vec![Source::Clip(source)])?;
    let (sender, updates) = channel();
    let settings = ViewSettings {
        title: format!("unic train: {clip}"),
        session,
        load: loader(Reader::of_dropped_files()),
        updates: Some(updates),
    };
    // The thread ends with the training, or when the window is closed.
    let forwarding = thread::Builder::new().name("previews".into());
    forwarding
        .spawn(move || forward(&news, &sender))
        .context("a thread cannot be started")?;
    Ok(view_in_window(settings)?)
}

/// Passes news on to the window.
fn forward(news: &Receiver<News>, window: &Sender<ViewUpdate>) {
    let waiting = "waiting for the first validation".to_owned();
    let mut updates = vec![ViewUpdate::Message(waiting)];
    loop {
        for update in updates.drain(..) {
            if window.send(update).is_err() {
                return;
            }
        }
        match news.recv() {
            Ok(News::Begun { .. }) => {}
            Ok(News::Model { step, model }) => {
                updates.push(ViewUpdate::Model(ModelSource {
                    name: "model".into(),
                    model,
                    motion: None,
                }));
                updates.push(ViewUpdate::Message(format!("model of step {step}")));
            }
            Ok(News::Message(message)) => updates.push(ViewUpdate::Message(message)),
            Ok(News::Interrupted) => updates.push(ViewUpdate::Close),
            Err(_) => return,
        }
    }
}
