//! `unic bench` without a subcommand: how fast frames are.

mod error;
mod instances;
mod machine;
mod report;
mod scene;
mod timing;

use crate::{
    args::SpeedArgs,
    failure::Usage,
    interrupt, model_file, motion_file,
    output::say,
    outputs::{Existing, Outputs},
};
use anyhow::{Context, Result, anyhow, bail};
use error::AddedError;
use instances::Instances;
use report::{Case, Report};
use scene::Scene;
use std::{num::NonZeroUsize, sync::Arc, time::Duration};
use timing::Timing;
use unic_builtin::scale;
use unic_core::{animator::Animator, model::Model, network::Precision};
use unic_io::{check, read_obj};

/// Percent of the vertices that a budget chooses from.
const PERCENTS: [f32; 9] = [100.0, 70.0, 50.0, 35.0, 25.0, 18.0, 12.0, 8.0, 5.0];

/// Measures and prints.
pub(crate) fn run(args: &SpeedArgs) -> Result<()> {
    if let (Some(_), [_, _, ..]) = (args.budget, args.precision.as_slice()) {
        let found = args.precision.len();
        return Err(Usage(format!(
            "--budget: expected one --precision to choose a sampling for, found {found}"
        ))
        .into());
    }
    if let Some(out) = &args.out {
        let inputs = [&args.model, &args.motion, &args.mesh, &args.reading.bone_map];
        Outputs::beside(inputs.into_iter().flatten())
            .file(out)
            .check(Existing::of(args.overwrite))?;
    }
    let mut report = Report::new();
    for subject in subjects(args) {
        let scene = subject.scene(args)?;
        for &precision in &args.precision {
            let bench = Bench {
                args,
                scene: &scene,
                exact: animator(args, &scene.model),
                precision: precision.into(),
                trained: matches!(subject, Subject::Trained),
            };
            match args.budget {
                Some(budget) => bench.choose(budget, &mut report)?,
                None => bench.all(&mut report)?,
            }
        }
    }
    report.show(args)
}

/// One scene in one precision.
struct Bench<'a> {
    args: &'a SpeedArgs,
    scene: &'a Scene,
    /// f32 at all vertices.
    exact: Animator,
    precision: Precision,
    trained: bool,
}

impl Bench<'_> {
    fn all(&self, report: &mut Report) -> Result<()> {
        for &percent in &self.args.sampling {
            let inexact = self.inexact(percent)?;
            let error = self.error(&inexact)?;
            for threads in thread_counts(self.args) {
                self.measure(&inexact, threads, error, report)?;
            }
        }
        Ok(())
    }

    /// The first percentage whose frames keep within the budget, or the last.
    fn choose(&self, budget: Duration, report: &mut Report) -> Result<()> {
        let threads = thread_counts(self.args).into_iter().max().unwrap_or(1);
        let budget_ms = budget.as_secs_f64() * 1e3;
        for percent in PERCENTS {
            let inexact = self.inexact(percent)?;
            let error = self.error(&inexact)?;
            let frame_ms = self.measure(&inexact, threads, error, report)?;
            if frame_ms <= budget_ms {
                return self.write(&inexact, percent);
            }
        }
        let fastest = PERCENTS[PERCENTS.len() - 1];
        bail!("expected a frame within {budget_ms} ms at {fastest} % of the vertices, found none");
    }

    fn write(&self, chosen: &Animator, percent: f32) -> Result<()> {
        say(&format!("{percent} % of the vertices keep within the budget"));
        if let Some(path) = &self.args.out {
            model_file::write(path, chosen.model())?;
        }
        Ok(())
    }

    fn inexact(&self, percent: f32) -> Result<Animator> {
        let model = Model::clone(&self.scene.model).with_precision(self.precision);
        let model = model.with_sampling(percent / 100.0)?;
        Ok(animator(self.args, &Arc::new(model)))
    }

    fn error(&self, inexact: &Animator) -> Result<Option<AddedError>> {
        let measure = || AddedError::measure(&self.exact, inexact, self.scene);
        self.trained.then(measure).transpose()
    }

    /// Milliseconds of a frame.
    fn measure(
        &self,
        animator: &Animator,
        threads: usize,
        error: Option<AddedError>,
        report: &mut Report,
    ) -> Result<f64> {
        interrupt::check()?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.context("threads cannot be started")?;
        let frames = self.args.frames.get();
        let timing = pool.install(|| Timing::measure(animator.clone(), self.scene, frames))?;
        let crowd = |count| pool.install(|| Instances::measure(animator, self.scene, count));
        let instances = NonZeroUsize::new(self.args.instances).map(crowd).transpose()?;
        let frame_ms = timing.frame;
        let mut case = Case::new(&self.scene.network, animator.model(), threads, timing, error);
        case.instances = instances;
        say(&case.to_string());
        report.cases.push(case);
        Ok(frame_ms)
    }
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

fn subjects(args: &SpeedArgs) -> Vec<Subject> {
    if args.model.is_some() {
        return vec![Subject::Trained];
    }
    let sizes = |&network| {
        let random = move |&vertices| Subject::Random {
            network: scale::Network::from(network),
            vertices: vertices as usize,
        };
        args.vertices.iter().map(random)
    };
    args.network.iter().flat_map(sizes).collect()
}

impl Subject {
    fn scene(self, args: &SpeedArgs) -> Result<Scene> {
        match (self, &args.model, &args.motion) {
            (Self::Random { network, vertices }, ..) => Scene::random(network, vertices),
            (Self::Trained, Some(model), Some(motion)) => {
                let mut model = model_file::read(model)?;
                if let Some(path) = &args.mesh {
                    let mesh = read_obj(path)?;
                    let rest = &model.garment().rest;
                    args.force.settle(path, &check::other_mesh(&mesh, rest))?;
                    model = model
                        .with_mesh(mesh)
                        .map_err(|e| anyhow!("{}: {e}", path.display()))?;
                }
                let (character, fps) = (model.character(), model.config().fps);
                let clip = motion_file::read(motion, character, fps, &args.reading, args.force)?;
                Scene::trained(model, clip)
            }
            (Self::Trained, ..) => Err(anyhow!("expected --model and --motion, found one of them")),
        }
    }
}

/// One thread, and all of them.
fn thread_counts(args: &SpeedArgs) -> Vec<usize> {
    if !args.on_threads.is_empty() {
        return args.on_threads.iter().map(|n| n.get()).collect();
    }
    match rayon::current_num_threads() {
        1 => vec![1],
        all => vec![1, all],
    }
}

fn animator(args: &SpeedArgs, model: &Arc<Model>) -> Animator {
    let mut animator = Animator::new(Arc::clone(model));
    if let Some(name) = args.intersection {
        animator.set_intersection(model_file::intersection(model, name));
    }
    animator
}
