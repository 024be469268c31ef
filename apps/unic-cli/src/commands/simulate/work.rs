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
use serde::{Deserialize, Serialize};
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
};
use unic_core::{character::Character, clip::Clip};
use unic_io::{CaptureWriter, capture::ClipWriter};
use unic_sim::{
    Cloth, Simulation, SimulationError, SimulationSettings,
    soundness::{Gauge, Soundness, Standing},
};

/// Everything that all clips share.
pub(super) struct Workshop<'a> {
    pub(super) character: Arc<Character>,
    pub(super) cut: &'a Cut,
    pub(super) cloth: Arc<Cloth>,
    pub(super) settings: SimulationSettings,
    /// Frames of a clip that are kept for pictures.
    pub(super) shots: usize,
}

/// What came out of one clip, as numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Row {
    pub(super) clip: String,
    pub(super) split: String,
    pub(super) frames: usize,
    /// CPU time of the simulation for a frame, settling included, seconds.
    pub(super) cpu_s_per_frame: f64,
    #[serde(flatten)]
    pub(super) soundness: Soundness,
    /// How much higher the hem hangs after the clip when the character stands again, mm.
    pub(super) creep_mm: f32,
}

/// A clip that this run has made.
pub(super) struct Made {
    pub(super) row: Row,
    pub(super) shots: Vec<(usize, Shot)>,
}

/// What an earlier run has left to go on from.
#[derive(Default)]
pub(super) struct Kept {
    pub(super) frames: u64,
    pub(super) rows: Vec<Row>,
}

/// Where rows go as soon as there is another one.
pub(super) type Keep<'a> = &'a (dyn Fn(&[Row]) -> Result<()> + Sync);

/// What the threads share.
struct Shift<'a, 'w> {
    standing: Standing,
    keep: Keep<'a>,
    bench: Mutex<Bench<'a, 'w>>,
}

/// What they change while they work.
struct Bench<'a, 'w> {
    queue: VecDeque<&'a Job>,
    writer: &'w mut CaptureWriter,
    progress: Progress,
    frames_done: u64,
    rows: Vec<Row>,
    made: Vec<Made>,
    failure: Option<anyhow::Error>,
}

impl Workshop<'_> {
    /// Makes all clips, as many at a time as there are threads; the order of the capture is that of
    /// `jobs`. The first failure stops the others at their next frame.
    pub(super) fn make<'a>(
        &self,
        jobs: &[&'a Job],
        kept: Kept,
        writer: &mut CaptureWriter,
        keep: Keep<'a>,
    ) -> Result<Vec<Made>> {
        if jobs.is_empty() {
            return Ok(Vec::new());
        }
        let standing = self.standing()?;
        let to_do: u64 = jobs.iter().map(|job| job.clip.len() as u64).sum();
        let bench = Bench {
            queue: jobs.iter().copied().collect(),
            writer,
            progress: Progress::new("simulating", kept.frames, kept.frames + to_do),
            frames_done: kept.frames,
            rows: kept.rows,
            made: Vec::new(),
            failure: None,
        };
        let shift = Shift {
            standing,
            keep,
            bench: Mutex::new(bench),
        };
        let threads = rayon::current_num_threads();
        let workers = jobs.len().clamp(1, threads);
        thread::scope(|scope| {
            for worker in 0..workers {
                let shift = &shift;
                // Threads that are left over help inside the first clips.
                let share = threads / workers + usize::from(worker < threads % workers);
                scope.spawn(move || self.work(share, shift));
            }
        });
        let bench = shift.bench.into_inner().unwrap_or_else(PoisonError::into_inner);
        match bench.failure {
            Some(error) => Err(error),
            None => Ok(bench.made),
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

    fn work(&self, threads: usize, shift: &Shift) {
        let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
            Ok(pool) => pool,
            Err(error) => return shift.fail(anyhow!("threads cannot be started: {error}")),
        };
        while let Some(next) = shift.take() {
            let made = next.and_then(|(job, writer)| pool.install(|| self.clip(job, writer, shift)));
            match made {
                Ok(made) => shift.lock().made.push(made),
                Err(error) => return shift.fail(error),
            }
        }
    }

    fn clip(&self, job: &Job, mut writer: ClipWriter, shift: &Shift) -> Result<Made> {
        let clip = &job.clip;
        let named = |e: SimulationError| anyhow!("clip {}: {e}", clip.name);
        let mut simulation = self.simulation(clip).map_err(named)?;
        let mut gauge = Gauge::new(&self.character, &self.cut.garment.rest, clip.fps);
        let wanted = evenly_spread(clip.len(), self.shots);
        let (mut shots, mut cpu_s) = (Vec::new(), 0.0);
        for t in 0..clip.len() {
            shift.go_on()?;
            let started = cpu_time_s();
            self.step(&mut simulation, clip, t, shift).map_err(named)?;
            cpu_s += cpu_time_s() - started;
            shift.go_on()?;
            let (body, garment) = (simulation.body().unwrap_or_default(), simulation.vertices());
            writer.push(garment)?;
            gauge.push(body, garment);
            if wanted.contains(&t) {
                let place = Place::new(&self.character.skeleton, &clip.poses[t]);
                let (body, garment) = (body.to_vec(), garment.to_vec());
                shots.push((t, Shot { body, garment, place }));
            }
            shift.advance(&clip.name);
        }
        let row = Row {
            clip: clip.name.clone(),
            split: job.split.name().to_owned(),
            frames: clip.len(),
            cpu_s_per_frame: cpu_s / clip.len() as f64,
            soundness: gauge.finish(),
            creep_mm: self.creep_mm(&mut simulation, clip, shift)?,
        };
        shift.record(&row)?;
        writer.finish()?;
        Ok(Made { row, shots })
    }

    fn simulation(&self, clip: &Clip) -> Result<Simulation, SimulationError> {
        let mut settings = self.settings.clone();
        if let Some(contact) = &mut settings.contact {
            contact.ground_height_m = Some(clip.ground_height);
        }
        Simulation::on_character(Arc::clone(&self.cloth), Arc::clone(&self.character), settings)
    }

    /// Frame `t`: the first is what settling leads to.
    fn step(
        &self,
        simulation: &mut Simulation,
        clip: &Clip,
        t: usize,
        shift: &Shift,
    ) -> Result<(), SimulationError> {
        let pose = &clip.poses[t];
        match t {
            0 => simulation
                .settle_while([pose, &clip.poses[1]], clip.wind_at(0), || shift.go_on().is_ok())
                .map(drop),
            _ => simulation.step_frame(pose, clip.wind_at(t)).map(drop),
        }
    }

    /// Stands the character up in still air at the end of its clip.
    fn creep_mm(&self, simulation: &mut Simulation, clip: &Clip, shift: &Shift) -> Result<f32> {
        let (skeleton, last) = (&self.character.skeleton, &clip.poses[clip.len() - 1]);
        for pose in Standing::way_from(skeleton, last, clip.fps) {
            shift.go_on()?;
            simulation.step_frame(&pose, Vec3::ZERO)?;
        }
        Ok(shift.standing.creep_mm(simulation, skeleton, last))
    }
}

impl<'a, 'w> Shift<'a, 'w> {
    /// The next clip with its files; none when there is no more to do.
    fn take(&self) -> Option<Result<(&'a Job, ClipWriter)>> {
        let mut bench = self.lock();
        if bench.failure.is_some() {
            return None;
        }
        let job = bench.queue.pop_front()?;
        // Begun in the order of the queue, so that the capture lists its clips in one order.
        let writer = bench.writer.begin_clip(&job.clip, job.split);
        Some(writer.map(|writer| (job, writer)).map_err(Into::into))
    }

    /// Before the clip's motion is in the folder: a finished clip has its row, whenever a run is
    /// interrupted.
    fn record(&self, row: &Row) -> Result<()> {
        let mut bench = self.lock();
        bench.rows.push(row.clone());
        (self.keep)(&bench.rows)
    }

    /// An error once another thread has failed or somebody has asked to stop.
    fn go_on(&self) -> Result<()> {
        if interrupt::is_asked() {
            return Err(interrupted());
        }
        match self.lock().failure {
            None => Ok(()),
            Some(_) => Err(anyhow!("another clip failed")),
        }
    }

    fn advance(&self, clip: &str) {
        let mut bench = self.lock();
        bench.frames_done += 1;
        let done = bench.frames_done;
        bench.progress.set(done, || clip.to_owned());
    }

    /// The first failure counts: others follow from it.
    fn fail(&self, error: anyhow::Error) {
        self.lock().failure.get_or_insert(error);
    }

    fn lock(&self) -> MutexGuard<'_, Bench<'a, 'w>> {
        self.bench.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn interrupted() -> anyhow::Error {
    let text = "interrupted; finished clips are kept, the same command with --resume goes on";
    Interrupted(text.into()).into()
}

/// CPU time of the threads of this pool so far, seconds.
fn cpu_time_s() -> f64 {
    let seconds = |_: rayon::BroadcastContext<'_>| {
        let time = clock_gettime(ClockId::ThreadCPUTime);
        time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
    };
    rayon::broadcast(seconds).iter().sum()
}
