//! Threads that simulate clips side by side.
//!
//! Each worker takes the next clip from a queue and simulates it from its own settling phase. Clips
//! do not depend on each other, so the result does not depend on which worker takes which clip.

use super::inputs::{GarmentInput, Job};
use crate::{
    failure::Interrupted,
    interrupt,
    pictures::{FrameSnapshot, Placement, Snapshot, evenly_spread},
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
    quality::{ClipQuality, CreepReference, QualityMeter},
};

/// Inputs and settings that all clips share.
pub(super) struct ClipSimulator<'a> {
    pub(super) character: Arc<Character>,
    pub(super) input: &'a GarmentInput,
    pub(super) cloth: Arc<Cloth>,
    pub(super) settings: SimulationSettings,
    /// Number of frames of a clip that are kept for pictures.
    pub(super) pictures: usize,
}

/// Measurements of one clip. The field names are keys of `--json` and `simulation.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ClipRow {
    pub(super) clip: String,
    pub(super) split: String,
    pub(super) frames: usize,
    /// CPU time of the simulation per frame, settling included, in seconds.
    pub(super) cpu_s_per_frame: f64,
    #[serde(flatten)]
    pub(super) quality: ClipQuality,
    /// Height that the hem has gained, in mm, when the character stands again after the clip.
    pub(super) creep_mm: f32,
}

/// Clip that this run has simulated.
pub(super) struct FinishedClip {
    pub(super) row: ClipRow,
    /// Frames for pictures, in the order of time.
    pub(super) pictures: Vec<FrameSnapshot>,
}

/// Clips that an earlier run has finished.
#[derive(Default)]
pub(super) struct EarlierProgress {
    pub(super) frames: u64,
    pub(super) rows: Vec<ClipRow>,
}

/// Callback that stores all rows, called whenever there is another one.
pub(super) type SaveRows<'a> = &'a (dyn Fn(&[ClipRow]) -> Result<()> + Sync);

/// Data that the workers share.
struct SharedWork<'a, 'w> {
    creep_reference: CreepReference,
    save_rows: SaveRows<'a>,
    state: Mutex<WorkState<'a, 'w>>,
}

/// Data that the workers change, under one lock.
struct WorkState<'a, 'w> {
    queue: VecDeque<&'a Job>,
    writer: &'w mut CaptureWriter,
    progress: Progress,
    frames_done: u64,
    rows: Vec<ClipRow>,
    finished: Vec<FinishedClip>,
    failure: Option<anyhow::Error>,
    /// Threads of workers that have found the queue empty. Running clips take them over.
    spare_threads: usize,
}

/// Threads of one worker.
struct Crew {
    pool: rayon::ThreadPool,
    threads: usize,
}

/// Clip whose files have been opened for writing.
struct OpenClip<'a> {
    job: &'a Job,
    writer: ClipWriter,
}

impl ClipSimulator<'_> {
    /// Simulates all clips, as many at a time as there are threads, in any order.
    ///
    /// # Errors
    /// The first failure of a clip, which stops the others at their next frame. An interruption.
    pub(super) fn simulate_all<'a>(
        &self,
        jobs: &[&'a Job],
        earlier: EarlierProgress,
        writer: &mut CaptureWriter,
        save_rows: SaveRows<'a>,
    ) -> Result<Vec<FinishedClip>> {
        if jobs.is_empty() {
            return Ok(Vec::new());
        }
        let creep_reference = self.creep_reference()?;
        let to_do: u64 = jobs.iter().map(|job| job.clip.len() as u64).sum();
        let state = WorkState {
            queue: jobs.iter().copied().collect(),
            writer,
            progress: Progress::new("simulating", earlier.frames, earlier.frames + to_do),
            frames_done: earlier.frames,
            rows: earlier.rows,
            finished: Vec::new(),
            failure: None,
            spare_threads: 0,
        };
        let shared = SharedWork {
            creep_reference,
            save_rows,
            state: Mutex::new(state),
        };
        let threads = rayon::current_num_threads();
        let workers = jobs.len().clamp(1, threads);
        thread::scope(|scope| {
            for worker in 0..workers {
                let shared = &shared;
                // With fewer clips than threads, each worker has several threads for its solver.
                // The first workers get those that remain.
                let share = threads / workers + usize::from(worker < threads % workers);
                scope.spawn(move || self.work(share, shared));
            }
        });
        let state = shared.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        match state.failure {
            Some(error) => Err(error),
            None => Ok(state.finished),
        }
    }

    /// Simulates a character that only stands: the reference for the creep of the clips.
    fn creep_reference(&self) -> Result<CreepReference> {
        let mut progress = Progress::new("settling", 0, CreepReference::frame_count(&self.settings));
        let mut frames = 0;
        let goes_on = || {
            progress.set(frames, || "standing".into());
            frames += 1;
            !interrupt::is_requested()
        };
        let standing = CreepReference::new(&self.cloth, &self.character, &self.settings, goes_on)?;
        standing.ok_or_else(interrupted)
    }

    /// Simulates clips of the queue until it is empty, then leaves the threads to other workers.
    fn work(&self, threads: usize, shared: &SharedWork) {
        let mut crew = match Crew::new(threads) {
            Ok(crew) => crew,
            Err(error) => return shared.fail(error),
        };
        while let Some(next) = shared.next_clip() {
            match next.and_then(|open| self.clip(open, &mut crew, shared)) {
                Ok(clip) => shared.lock().finished.push(clip),
                Err(error) => return shared.fail(error),
            }
        }
        shared.lock().spare_threads += crew.threads;
    }

    /// Simulates one clip and writes its files.
    fn clip(&self, open: OpenClip, crew: &mut Crew, shared: &SharedWork) -> Result<FinishedClip> {
        let OpenClip { job, mut writer } = open;
        let clip = &job.clip;
        let named = |e: SimulationError| anyhow!("clip {}: {e}", clip.name);
        let mut simulation = self.simulation(clip).map_err(named)?;
        let mut meter = QualityMeter::new(&self.character, &self.input.garment.rest, clip.fps);
        let picture_frames = evenly_spread(clip.len(), self.pictures);
        let (mut pictures, mut cpu_s) = (Vec::new(), 0.0);
        let mut frame = |t: usize| -> Result<()> {
            let started = cpu_time_s();
            self.step(&mut simulation, clip, t, shared).map_err(named)?;
            cpu_s += cpu_time_s() - started;
            // Settling returns early when it is stopped: its frame must not be written.
            shared.check_stop()?;
            let (body, garment) = (simulation.body().unwrap_or_default(), simulation.vertices());
            writer.push(garment)?;
            meter.push(body, garment);
            if picture_frames.contains(&t) {
                let snapshot = Snapshot {
                    body: body.to_vec(),
                    garment: garment.to_vec(),
                    placement: Placement::new(&self.character.skeleton, &clip.poses[t]),
                };
                pictures.push(FrameSnapshot { frame: t, snapshot });
            }
            Ok(())
        };
        for t in 0..clip.len() {
            shared.check_stop()?;
            crew.enlist(shared)?;
            crew.pool.install(|| frame(t))?;
            shared.advance(&clip.name);
        }
        let row = ClipRow {
            clip: clip.name.clone(),
            split: job.split.name().to_owned(),
            frames: clip.len(),
            cpu_s_per_frame: cpu_s / clip.len() as f64,
            quality: meter.finish(),
            creep_mm: (crew.pool).install(|| self.creep_mm(&mut simulation, clip, shared))?,
        };
        // The row is saved first: whenever a run is killed, every finished clip has its row.
        shared.record(&row)?;
        writer.finish()?;
        Ok(FinishedClip { row, pictures })
    }

    /// Creates the solver for a clip, whose ground may have its own height.
    fn simulation(&self, clip: &Clip) -> Result<Simulation, SimulationError> {
        let mut settings = self.settings.clone();
        if let Some(contact) = &mut settings.contact {
            contact.ground_height_m = Some(clip.ground_height);
        }
        Simulation::on_character(Arc::clone(&self.cloth), Arc::clone(&self.character), settings)
    }

    /// Advances the simulation to frame `t`. Frame 0 is the end of the settling phase.
    fn step(
        &self,
        simulation: &mut Simulation,
        clip: &Clip,
        t: usize,
        shared: &SharedWork,
    ) -> Result<(), SimulationError> {
        let pose = &clip.poses[t];
        match t {
            0 => simulation
                .settle_while(pose, &clip.poses[1], clip.wind_at(0), || {
                    shared.check_stop().is_ok()
                })
                .map(drop),
            _ => simulation.step_frame(pose, clip.wind_at(t)).map(drop),
        }
    }

    /// Measures the creep in mm: the character moves from its last pose to standing, in still air.
    fn creep_mm(&self, simulation: &mut Simulation, clip: &Clip, shared: &SharedWork) -> Result<f32> {
        let (skeleton, last) = (&self.character.skeleton, &clip.poses[clip.len() - 1]);
        for pose in CreepReference::poses_to_standing(skeleton, last, clip.fps) {
            shared.check_stop()?;
            simulation.step_frame(&pose, Vec3::ZERO)?;
        }
        Ok(shared.creep_reference.creep_mm(simulation, skeleton, last))
    }
}

impl Crew {
    fn new(threads: usize) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| anyhow!("threads cannot be started: {error}"))?;
        Ok(Self { pool, threads })
    }

    /// Takes over the threads that other workers have left. A clip has the same bytes on any number
    /// of threads.
    fn enlist(&mut self, shared: &SharedWork) -> Result<()> {
        match std::mem::take(&mut shared.lock().spare_threads) {
            0 => {}
            spare => *self = Self::new(self.threads + spare)?,
        }
        Ok(())
    }
}

impl<'a, 'w> SharedWork<'a, 'w> {
    /// Takes the next clip from the queue and opens its files. `None` when there is no more to do.
    fn next_clip(&self) -> Option<Result<OpenClip<'a>>> {
        let mut state = self.lock();
        if state.failure.is_some() {
            return None;
        }
        let job = state.queue.pop_front()?;
        // Clips begin under the lock, in the order of the queue: the capture lists them in one
        // order.
        let writer = state.writer.begin_clip(&job.clip, job.split);
        Some(writer.map(|writer| OpenClip { job, writer }).map_err(Into::into))
    }

    /// Adds the row of a clip and saves all rows.
    fn record(&self, row: &ClipRow) -> Result<()> {
        let mut state = self.lock();
        state.rows.push(row.clone());
        (self.save_rows)(&state.rows)
    }

    /// Returns an error if another worker has failed or the user has asked to stop.
    fn check_stop(&self) -> Result<()> {
        if interrupt::is_requested() {
            return Err(interrupted());
        }
        match self.lock().failure {
            None => Ok(()),
            Some(_) => Err(anyhow!("another clip failed")),
        }
    }

    /// Counts a finished frame of a clip and shows the progress.
    fn advance(&self, clip: &str) {
        let mut state = self.lock();
        state.frames_done += 1;
        let done = state.frames_done;
        state.progress.set(done, || clip.to_owned());
    }

    /// Keeps the first failure. Later ones are only its consequences.
    fn fail(&self, error: anyhow::Error) {
        self.lock().failure.get_or_insert(error);
    }

    fn lock(&self) -> MutexGuard<'_, WorkState<'a, 'w>> {
        // A worker that panicked ends the whole command; the state is still good enough to stop.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn interrupted() -> anyhow::Error {
    let text = "interrupted; finished clips are kept, the same command with --resume continues";
    Interrupted(text.into()).into()
}

/// CPU time in seconds that the threads of the current pool have used.
fn cpu_time_s() -> f64 {
    // The clock of the process would count the workers of other clips too.
    let seconds = |_: rayon::BroadcastContext<'_>| {
        let time = clock_gettime(ClockId::ThreadCPUTime);
        time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
    };
    rayon::broadcast(seconds).iter().sum()
}
