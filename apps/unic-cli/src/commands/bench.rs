//! `unic bench`.

mod error;
mod machine;
mod report;
mod scene;
mod timing;

use crate::{args::BenchArgs, interrupt, model_file, motion_file, output::say};
use anyhow::{Context, Result, anyhow};
use error::AddedError;
use report::{Case, Report};
use scene::Scene;
use std::sync::Arc;
use timing::Timing;
use unic_builtin::scale;
use unic_core::{animator::Animator, model::Model, network::Precision};

/// Measures and prints.
pub(crate) fn run(args: &BenchArgs) -> Result<()> {
    let mut report = Report::new();
    for subject in subjects(args) {
        let scene = subject.scene(args)?;
        let exact = animator(args, &scene.model);
        for &precision in &args.precision {
            let precision = Precision::from(precision);
            let model = Arc::new(Model::clone(&scene.model).with_precision(precision));
            let inexact = animator(args, &model);
            let error = match subject {
                Subject::Trained => Some(AddedError::measure(&exact, &inexact, &scene)?),
                Subject::Random { .. } => None,
            };
            for threads in thread_counts(args) {
                interrupt::check()?;
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let pool = pool.context("threads cannot be started")?;
                let timing = pool.install(|| Timing::measure(inexact.clone(), &scene, args.frames.get()))?;
                let case = Case::new(&scene, precision, threads, timing, error);
                say(&case.to_string());
                report.cases.push(case);
            }
        }
    }
    report.show(args)
}

/// What is measured.
#[derive(Clone, Copy)]
enum Subject {
    /// The model that was named.
    Trained,
    /// Random weights.
    Random {
        network: scale::Network,
        vertices: usize,
    },
}

fn subjects(args: &BenchArgs) -> Vec<Subject> {
    if args.model.is_some() {
        return vec![Subject::Trained];
    }
    let sizes = |&network| {
        let random = move |&vertices| Subject::Random {
            network: scale::Network::from(network),
            vertices,
        };
        args.vertices.iter().map(random)
    };
    args.network.iter().flat_map(sizes).collect()
}

impl Subject {
    fn scene(self, args: &BenchArgs) -> Result<Scene> {
        match (self, &args.model, &args.motion) {
            (Self::Random { network, vertices }, ..) => Scene::random(network, vertices),
            (Self::Trained, Some(model), Some(motion)) => {
                let model = model_file::read(model)?;
                let clip = motion_file::read(motion, model.character(), model.config().fps, &args.reading)?;
                Scene::trained(model, clip)
            }
            (Self::Trained, ..) => Err(anyhow!("expected --model and --motion, found one of them")),
        }
    }
}

/// One thread, and all of them.
fn thread_counts(args: &BenchArgs) -> Vec<usize> {
    if !args.on_threads.is_empty() {
        return args.on_threads.iter().map(|n| n.get()).collect();
    }
    match rayon::current_num_threads() {
        1 => vec![1],
        all => vec![1, all],
    }
}

fn animator(args: &BenchArgs, model: &Arc<Model>) -> Animator {
    let mut animator = Animator::new(Arc::clone(model));
    if let Some(name) = args.intersection {
        animator.set_intersection(model_file::intersection(model, name));
    }
    animator
}
