//! `unic bench`: how fast frames are.

mod control;
mod error;
mod instances;
mod machine;
mod report;
mod scene;
mod timing;

use crate::{
    args::{BenchArgs, OtherBench},
    failure::Usage,
    interrupt, model_file, motion_file,
    output::print_status,
    outputs::{Existing, Outputs},
};
use anyhow::{Context, Result, anyhow, bail};
use error::AddedError;
use instances::Instances;
use report::{BenchmarkCase, SpeedReport};
use scene::Scene;
use std::{num::NonZeroUsize, sync::Arc, time::Duration};
use timing::Timing;
use unic_builtin::scale;
use unic_core::{Animator, Model, Precision};
use unic_io::{check, read_obj};

/// Shares of the vertices that a budget chooses from, percent.
// From large to small, each about 1.4 times the next: time falls about in proportion.
const PERCENTS: [f32; 9] = [100.0, 70.0, 50.0, 35.0, 25.0, 18.0, 12.0, 8.0, 5.0];

/// Measures and prints.
pub(crate) fn run(args: &BenchArgs) -> Result<()> {
    if let Some(OtherBench::Control(args)) = &args.other {
        return control::run(args);
    }
    let precisions = args.precisions();
    if let (Some(_), [_, _, ..]) = (args.budget, precisions.as_slice()) {
        let found = precisions.len();
        return Err(Usage(format!(
            "--budget: expected one --precision to choose a sampling for, found {found}"
        ))
        .into());
    }
    if let Some(out) = &args.out {
        let motion = motion_file::files(&args.motion);
        let others = [&args.model, &args.mesh, &args.reading.bone_map];
        Outputs::with_inputs(others.into_iter().flatten().chain(motion))
            .file(out)
            .check(Existing::of(args.overwrite))?;
    }
    args.warn();
    let mut report = SpeedReport::new();
    for subject in subjects(args) {
        let scene = subject.scene(args)?;
        for &precision in &precisions {
            let benchmark = SceneBenchmark {
                args,
                scene: &scene,
                exact: animator(args, &scene.model),
                precision: precision.into(),
                trained: matches!(subject, Subject::Trained),
            };
            match args.budget {
                Some(budget) => benchmark.choose_sampling(budget, &mut report)?,
                None => benchmark.measure_all(&mut report)?,
            }
        }
    }
    report.show(args)
}

/// Benchmark of one scene in one precision.
struct SceneBenchmark<'a> {
    args: &'a BenchArgs,
    scene: &'a Scene,
    /// Animator in f32 at all vertices, the reference for errors.
    exact: Animator,
    precision: Precision,
    /// True for trained weights, whose errors mean something.
    trained: bool,
}

impl SceneBenchmark<'_> {
    /// Measures every sampling on every number of threads.
    fn measure_all(&self, report: &mut SpeedReport) -> Result<()> {
        for &percent in &self.args.sampling {
            let inexact = self.inexact(percent)?;
            let error = self.error(&inexact)?;
            for threads in self.args.thread_counts() {
                self.measure(&inexact, threads, error, report)?;
            }
        }
        Ok(())
    }

    /// Chooses the first sampling whose frames keep within the budget.
    fn choose_sampling(&self, budget: Duration, report: &mut SpeedReport) -> Result<()> {
        let threads = self.args.thread_counts().into_iter().max().unwrap_or(1);
        let budget_ms = budget.as_secs_f64() * 1e3;
        // Smaller samplings are faster and less exact: the first that fits is the best.
        for percent in PERCENTS {
            let inexact = self.inexact(percent)?;
            let error = self.error(&inexact)?;
            let frame_ms = self.measure(&inexact, threads, error, report)?;
            if frame_ms <= budget_ms {
                return self.write(&inexact, percent);
            }
        }
        // The budget is missed by all. A model that is too slow is not written.
        let fastest = PERCENTS[PERCENTS.len() - 1];
        bail!("expected a frame within {budget_ms} ms at {fastest} % of the vertices, found none");
    }

    /// Writes the model with the chosen sampling.
    fn write(&self, chosen: &Animator, percent: f32) -> Result<()> {
        print_status(&format!("{percent} % of the vertices keep within the budget"));
        if let Some(path) = &self.args.out {
            model_file::write(path, chosen.model())?;
        }
        Ok(())
    }

    /// Returns an animator with the precision and a sampling, which is faster and less exact.
    fn inexact(&self, percent: f32) -> Result<Animator> {
        let model = Model::clone(&self.scene.model).with_precision(self.precision);
        let model = model.with_sampling(percent / 100.0)?;
        Ok(animator(self.args, &Arc::new(model)))
    }

    /// Returns the error that the precision and the sampling add. Random weights have none.
    fn error(&self, inexact: &Animator) -> Result<Option<AddedError>> {
        let measure = || AddedError::measure(&self.exact, inexact, self.scene);
        self.trained.then(measure).transpose()
    }

    /// Measures an animator. Returns the median time of a frame, milliseconds.
    fn measure(
        &self,
        animator: &Animator,
        threads: usize,
        error: Option<AddedError>,
        report: &mut SpeedReport,
    ) -> Result<f64> {
        interrupt::check()?;
        // A pool of its own: the global pool has the threads of --threads.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.context("threads cannot be started")?;
        let frames = self.args.frames.get();
        let timing = pool.install(|| Timing::measure(animator.clone(), self.scene, frames))?;
        let crowd = |count| pool.install(|| Instances::measure(animator, self.scene, count));
        let instances = NonZeroUsize::new(self.args.instances).map(crowd).transpose()?;
        let frame_ms = timing.frame;
        let mut case = BenchmarkCase::new(&self.scene.network, animator.model(), threads, timing, error);
        case.instances = instances;
        print_status(&case.to_string());
        report.cases.push(case);
        Ok(frame_ms)
    }
}

/// Subject of the benchmark.
#[derive(Clone, Copy)]
enum Subject {
    /// Model of the command line.
    Trained,
    /// Model with random weights.
    Random {
        network: scale::NetworkSize,
        vertices: usize,
    },
}

/// Lists the subjects that the command line asks for.
fn subjects(args: &BenchArgs) -> Vec<Subject> {
    if args.model.is_some() {
        return vec![Subject::Trained];
    }
    let sizes = |&network| {
        let random = move |vertices| Subject::Random {
            network: scale::NetworkSize::from(network),
            vertices: vertices as usize,
        };
        args.vertices().into_iter().map(random)
    };
    args.network.iter().flat_map(sizes).collect()
}

impl Subject {
    /// Prepares the model and the motion of a subject.
    fn scene(self, args: &BenchArgs) -> Result<Scene> {
        match (self, &args.model, &args.motion) {
            (Self::Random { network, vertices }, ..) => Scene::random(network, vertices),
            (Self::Trained, Some(model), Some(motion)) => {
                let mut model = model_file::read(model)?;
                if let Some(path) = &args.mesh {
                    let mesh = read_obj(path)?;
                    let rest = &model.garment().rest;
                    args.force.check_findings(path, &check::other_mesh(&mesh, rest))?;
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

/// Makes an animator with the intersection handling of the command line.
fn animator(args: &BenchArgs, model: &Arc<Model>) -> Animator {
    let mut animator = Animator::new(Arc::clone(model));
    if let Some(name) = args.intersection {
        animator.set_intersection(model_file::intersection(model, name));
    }
    animator
}
