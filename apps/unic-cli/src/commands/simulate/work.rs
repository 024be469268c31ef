//! Clips to be made, and the threads that make them.

use super::inputs::{Cut, Job};
use crate::{
    failure::Interrupted,
    interrupt,
    pictures::{Place, Shot, evenly_spread},
    progress::Progress,
};
use anyhow::{Result, anyhow};
use glam::Vec3;
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
    thread,
};
use unic_core::{character::Character, clip::Clip};
use unic_io::{CaptureWriter, capture::ClipWriter};
use unic_sim::{
    Cloth, Simulation, SimulationSettings,
    soundness::{Gauge, Soundness, Standing},
};

/// Everything that all clips share.
pub(super) struct Workshop<'a> {
    pub(super) character: Arc<Character>,
    pub(super) cut: &'a Cut,
    pub(super) cloth: Arc<Cloth>,
    pub(super) settings: SimulationSettings,
    pub(super) wind: Vec3,
    /// Frames of a clip that are kept for pictures.
    pub(super) shots: usize,
}

/// What came out of one clip.
#[derive(Serialize)]
pub(super) struct Made {
    pub(super) clip: String,
    pub(super) split: &'static str,
    pub(super) frames: usize,
    /// CPU time of the simulation for a frame, settling included, seconds.
    pub(super) cpu_s_per_frame: f64,
    #[serde(flatten)]
    pub(super) soundness: Soundness,
    /// How much higher the hem hangs after the clip when the character stands again, mm.
    pub(super) creep_mm: f32,
    #[serde(skip)]
    pub(super) shots: Vec<(usize, Shot)>,
}

/// What the threads share while they work.
struct Bench<'a, 'w> {
    queue: VecDeque<&'a Job>,
    writer: &'w mut CaptureWriter,
    progress: Progress,
    frames_done: u64,
    made: Vec<Made>,
    failure: Option<anyhow::Error>,
}

impl Workshop<'_> {
    /// Makes all clips, as many at a time as there are threads; the order of the capture is that of
    /// `jobs`. The first failure stops the others at their next frame.
    pub(super) fn make(&self, jobs: &[&Job], done: u64, writer: &mut CaptureWriter) -> Result<Vec<Made>> {
        if jobs.is_empty() {
            return Ok(Vec::new());
        }
        let standing = &self.standing()?;
        let to_do: u64 = jobs.iter().map(|job| job.clip.len() as u64).sum();
        let bench = Mutex::new(Bench {
            queue: jobs.iter().copied().collect(),
            writer,
            progress: Progress::new("simulating", done, done + to_do),
            frames_done: done,
            made: Vec::new(),
            failure: None,
        });
        let threads = rayon::current_num_threads();
        let workers = jobs.len().clamp(1, threads);
        thread::scope(|scope| {
            for worker in 0..workers {
                let bench = &bench;
                // Threads that are left over help inside the first clips.
                let share = threads / workers + usize::from(worker < threads % workers);
                scope.spawn(move || self.work(share, standing, bench));
            }
        });
        let bench = bench.into_inner().unwrap_or_else(PoisonError::into_inner);
        match bench.failure {
            Some(error) => Err(error),
            None => Ok(in_order(bench.made, jobs)),
        }
    }

    /// What creeping is measured against.
    fn standing(&self) -> Result<Standing> {
        let mut progress = Progress::new("settling", 0, Standing::frames(&self.settings));
        let mut frames = 0;
        let goes_on = || {
            progress.set(frames, || "standing".into());
            frames += 1;
            !interrupt::is_asked()
        };
        let standing = Standing::new(&self.cloth, &self.character, &self.settings, goes_on)?;
        standing.ok_or_else(interrupted)
    }

    fn work(&self, threads: usize, standing: &Standing, bench: &Mutex<Bench>) {
        let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
            Ok(pool) => pool,
            Err(error) => return fail(bench, anyhow!("threads cannot be started: {error}")),
        };
        while let Some(next) = self.take(bench) {
            let made =
                next.and_then(|(job, writer)| pool.install(|| self.clip(job, writer, standing, bench)));
            match made {
                Ok(made) => lock(bench).made.push(made),
                Err(error) => return fail(bench, error),
            }
        }
    }

    /// The next clip with its files; none when there is no more to do.
    fn take<'a>(&self, bench: &Mutex<Bench<'a, '_>>) -> Option<Result<(&'a Job, ClipWriter)>> {
        let mut bench = lock(bench);
        if bench.failure.is_some() {
            return None;
        }
        let job = bench.queue.pop_front()?;
        let wind = vec![self.wind; job.clip.len()];
        let wind = (self.wind != Vec3::ZERO).then_some(wind.as_slice());
        // Begun in the order of the queue, so that the capture lists its clips in one order.
        let writer = bench.writer.begin_clip(&job.clip, job.split, wind);
        Some(writer.map(|writer| (job, writer)).map_err(Into::into))
    }

    fn clip(
        &self,
        job: &Job,
        mut writer: ClipWriter,
        standing: &Standing,
        bench: &Mutex<Bench>,
    ) -> Result<Made> {
        let clip = &job.clip;
        let named = |e: unic_sim::SimulationError| anyhow!("clip {}: {e}", clip.name);
        let mut settings = self.settings.clone();
        if let Some(contact) = &mut settings.contact {
            contact.ground_height_m = Some(clip.ground_height);
        }
        let (cloth, character) = (Arc::clone(&self.cloth), Arc::clone(&self.character));
        let mut simulation = Simulation::on_character(cloth, character, settings).map_err(named)?;
        let mut gauge = Gauge::new(&self.character, &self.cut.garment.rest, clip.fps);
        let wanted = evenly_spread(clip.len(), self.shots);
        let (mut shots, mut cpu_s) = (Vec::new(), 0.0);
        for (t, pose) in clip.poses.iter().enumerate() {
            go_on(bench)?;
            let started = cpu_time_s();
            match t {
                0 => {
                    let next = &clip.poses[1];
                    simulation
                        .settle_while(pose, next, || go_on(bench).is_ok())
                        .map(drop)
                }
                _ => simulation.step_frame(pose, self.wind).map(drop),
            }
            .map_err(named)?;
            go_on(bench)?;
            cpu_s += cpu_time_s() - started;
            let (body, garment) = (simulation.body().unwrap_or_default(), simulation.vertices());
            writer.push(garment)?;
            gauge.push(body, garment);
            if wanted.contains(&t) {
                let place = Place::new(&self.character.skeleton, pose);
                shots.push((
                    t,
                    Shot {
                        body: body.to_vec(),
                        garment: garment.to_vec(),
                        place,
                    },
                ));
            }
            advance(bench, &clip.name);
        }
        writer.finish()?;
        Ok(Made {
            clip: clip.name.clone(),
            split: job.split.name(),
            frames: clip.len(),
            cpu_s_per_frame: cpu_s / clip.len() as f64,
            soundness: gauge.finish(),
            creep_mm: self.creep_mm(standing, &mut simulation, clip, bench)?,
            shots,
        })
    }
}

impl Workshop<'_> {
    /// Stands the character up at the end of its clip.
    fn creep_mm(
        &self,
        standing: &Standing,
        simulation: &mut Simulation,
        clip: &Clip,
        bench: &Mutex<Bench>,
    ) -> Result<f32> {
        let (skeleton, last) = (&self.character.skeleton, &clip.poses[clip.len() - 1]);
        for pose in Standing::way_from(skeleton, last, clip.fps) {
            go_on(bench)?;
            simulation.step_frame(&pose, self.wind)?;
        }
        Ok(standing.creep_mm(simulation, skeleton, last))
    }
}

fn in_order(mut made: Vec<Made>, jobs: &[&Job]) -> Vec<Made> {
    made.sort_by_key(|made| jobs.iter().position(|job| job.clip.name == made.clip));
    made
}

/// An error once another thread has failed or somebody has asked to stop.
fn go_on(bench: &Mutex<Bench>) -> Result<()> {
    if interrupt::is_asked() {
        return Err(interrupted());
    }
    match lock(bench).failure {
        None => Ok(()),
        Some(_) => Err(anyhow!("another clip failed")),
    }
}

fn interrupted() -> anyhow::Error {
    let text = "interrupted; finished clips are kept, the same command with --resume goes on";
    Interrupted(text.into()).into()
}

fn advance(bench: &Mutex<Bench>, clip: &str) {
    let mut bench = lock(bench);
    bench.frames_done += 1;
    let done = bench.frames_done;
    bench.progress.set(done, || clip.to_owned());
}

/// CPU time of the threads of this pool so far, seconds.
fn cpu_time_s() -> f64 {
    let seconds = |_: rayon::BroadcastContext<'_>| {
        let time = clock_gettime(ClockId::ThreadCPUTime);
        time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
    };
    rayon::broadcast(seconds).iter().sum()
}

/// The first failure counts: others follow from it.
fn fail(bench: &Mutex<Bench>, error: anyhow::Error) {
    lock(bench).failure.get_or_insert(error);
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
