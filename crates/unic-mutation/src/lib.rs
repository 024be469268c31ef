//! Damaged files: what a reader must refuse in a sentence or read, and never die of.
//!
//! [`survive`] takes a sound file and a reader. It cuts the file at every byte, then damages it at
//! random until the time is up: bits, bytes, counts, numbers in text, lines, whole parts of an archive
//! whose checksums are made right again. Every outcome must be a value or one sentence, in bounded time
//! and within [`Tally::ALLOWED`] memory.
//!
//! The random stream of a reader is always the same; the time says how far it goes.
//!
//! | variable | meaning |
//! |---|---|
//! | `UNIC_MUTATION_SECONDS` | time for each reader's random damage, seconds; 2 where it is not set |
//! | `UNIC_MUTATION_SEED` | one file alone, the one of this seed |
//!
//! A failure prints the seed and keeps the file. A process that is aborted, because memory ran out or a
//! reader hung, leaves the file that it was reading where it was.
//!
//! Memory is counted only in a program whose allocator is [`Counting`]:
//!
//! ```
//! use unic_mutation::{Container, Counting, Subject, survive, workshop};
//!
//! #[global_allocator]
//! static ALLOCATOR: Counting = Counting;
//!
//! # fn main() {
//! # let folder = tempfile::tempdir().unwrap();
//! let path = workshop(folder.path(), "text").join("sound.txt");
//! std::fs::write(&path, "a sound file").unwrap();
//! let subject = Subject { name: "text", path: &path, container: Container::Plain };
//! let tally = survive(&subject, |path| {
//!     let read = std::fs::read_to_string(path);
//!     read.map(drop).map_err(|e| e.to_string())
//! });
//! assert!(tally.read > 0 && tally.refused > 0);
//! # }
//! ```

#![allow(
    clippy::unwrap_used,
    reason = "a set-up that fails is a test that fails; nothing else links this crate"
)]

mod change;
mod container;
mod heap;
mod npy;
mod random;
#[cfg(test)]
mod tests;
mod watch;

pub use container::Container;
pub use heap::Counting;

use container::Parts;
use random::Random;
use std::{
    any::Any,
    fmt::{self, Display},
    fs::{self, File},
    io::Write,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};
use watch::Watch;

/// A sound file and who reads it.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// Names the reader, its random stream and the files that are kept.
    pub name: &'a str,
    /// The file: it is damaged in place, and sound again at the end.
    pub path: &'a Path,
    /// What keeps its parts together.
    pub container: Container,
}

/// What became of the damaged files of one reader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Damage that nobody could see, or that did not matter.
    pub read: usize,
    /// Refused in a sentence.
    pub refused: usize,
    /// The most that any of them took.
    pub most: Cost,
}

impl Tally {
    /// Memory that a reading may hold: bytes for each byte of the file, and bytes besides.
    pub const ALLOWED: (usize, usize) = (64, 32 << 20);
}

impl Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { read, refused, most } = self;
        write!(
            f,
            "{} damaged files: {read} read, {refused} refused, at most {most}",
            read + refused
        )
    }
}

/// What a reading has taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Most memory that it held, bytes.
    pub peak: usize,
    /// Wall time.
    pub time: Duration,
}

impl Cost {
    /// Whether that is in proportion to a file of so many bytes.
    pub fn is_bounded(&self, length: usize) -> bool {
        let (a_byte, besides) = Tally::ALLOWED;
        self.peak <= a_byte * length + besides && self.time <= LONGEST
    }
}

impl Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { peak, time } = self;
        write!(
            f,
            "{:.2} MB and {:.1} ms",
            *peak as f64 / 1e6,
            1e3 * time.as_secs_f64()
        )
    }
}

/// What `read` gives, and what it has taken.
pub fn measured<T>(read: impl FnOnce() -> T) -> (T, Cost) {
    let (start, before) = (Instant::now(), heap::mark());
    let value = read();
    let (peak, time) = (heap::peak_since(before), start.elapsed());
    (value, Cost { peak, time })
}

/// Longest reading of a small file: far more than any takes on a busy machine.
const LONGEST: Duration = Duration::from_secs(10);

/// A sentence for people does not repeat a file to them.
const LONGEST_SENTENCE: usize = 1000;

/// Files are cut at every byte up to so many; longer ones in as many places.
const MOST_CUTS: usize = 4096;

/// An empty folder for the files of one test, below a folder that lasts: `CARGO_TARGET_TMPDIR`.
///
/// # Panics
/// When it cannot be made.
pub fn workshop(below: &Path, test: &str) -> PathBuf {
    let folder = below.join("mutations").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Damages a file again and again; `read` tells by a sentence that it refuses one.
///
/// A reader that gives a value uses it as well: a value that nobody can work with is no value.
///
/// # Panics
/// With the seed and the file, when `read` panics, takes too long, holds too much memory, or refuses
/// without a sentence; and when it refuses the sound file.
pub fn survive(subject: &Subject<'_>, mut read: impl FnMut(&Path) -> Result<(), String>) -> Tally {
    let sound = fs::read(subject.path).unwrap();
    if let Err(sentence) = read(subject.path) {
        panic!("{}: the sound file is refused: {sentence}", subject.name);
    }
    let mut trial = Trial {
        subject,
        read: &mut read,
        watch: Watch::start(subject.name.to_owned()),
        tally: Tally::default(),
    };
    match number("UNIC_MUTATION_SEED") {
        Some(seed) => trial.damage(&sound, seed),
        None => trial.all(&sound),
    }
    let tally = trial.tally;
    fs::write(subject.path, sound).unwrap();
    eprintln!("{}: {tally}", subject.name);
    tally
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok().and_then(|text| text.parse().ok())
}

struct Trial<'a> {
    subject: &'a Subject<'a>,
    read: &'a mut dyn FnMut(&Path) -> Result<(), String>,
    watch: Watch,
    tally: Tally,
}

impl Trial<'_> {
    fn all(&mut self, sound: &[u8]) {
        self.cuts(sound);
        let time = Duration::from_secs(number("UNIC_MUTATION_SECONDS").unwrap_or(2));
        let start = Instant::now();
        for seed in 0.. {
            if start.elapsed() >= time {
                return;
            }
            self.damage(sound, seed);
        }
    }

    /// The file cut short, and each of its parts cut short in a sound container.
    fn cuts(&mut self, sound: &[u8]) {
        for end in cut_places(sound.len()) {
            self.try_file(&sound[..end], &format!("cut-{end}"));
        }
        let parts = Parts::of(self.subject.container, sound);
        for (i, whole) in parts.contents().enumerate().filter(|_| parts.len() > 1) {
            for end in cut_places(whole.len()) {
                let bytes = parts.with(i, &whole[..end]).bytes();
                self.try_file(&bytes, &format!("part-{i}-cut-{end}"));
            }
        }
    }

    fn damage(&mut self, sound: &[u8], seed: u64) {
        let mut random = Random::new(self.subject.name, seed);
        let bytes = container::damaged(self.subject.container, sound, &mut random);
        self.try_file(&bytes, &format!("seed-{seed}"));
    }

    fn try_file(&mut self, bytes: &[u8], label: &str) {
        overwrite(self.subject.path, bytes).unwrap();
        self.watch.begin(label);
        let (outcome, cost) = measured(|| catch_unwind(AssertUnwindSafe(|| (self.read)(self.subject.path))));
        let wrong = match &outcome {
            Ok(Ok(())) => None,
            Ok(Err(sentence)) => fault_of(sentence),
            Err(_) => Some("a panic".into()),
        };
        let wrong = wrong.or_else(|| (!cost.is_bounded(bytes.len())).then(|| cost.to_string()));
        if let Some(wrong) = wrong {
            self.fail(bytes, label, &wrong, outcome.err());
        }
        let most = &mut self.tally.most;
        (most.peak, most.time) = (most.peak.max(cost.peak), most.time.max(cost.time));
        match outcome {
            Ok(Ok(())) => self.tally.read += 1,
            _ => self.tally.refused += 1,
        }
    }

    /// Keeps the file beside the folder of the test.
    fn fail(&self, bytes: &[u8], label: &str, wrong: &str, panic: Option<Box<dyn Any + Send>>) -> ! {
        let Subject { name, path, .. } = self.subject;
        let ending = path.file_name().unwrap_or_default().to_string_lossy();
        let kept = path.parent().unwrap().parent().unwrap();
        let kept = kept.join(format!("{name}-{label}-{ending}"));
        fs::write(&kept, bytes).unwrap();
        let told = format!("{name}, {label}: {wrong}; the file is kept as {}", kept.display());
        eprintln!("{told}");
        match panic {
            Some(panic) => resume_unwind(panic),
            None => panic!("{told}"),
        }
    }
}

/// As [`fs::write`], but never of no length in between: filesystems take that for the saving of a
/// document and wait for the disk.
fn overwrite(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = File::options().write(true).open(path)?;
    file.write_all(bytes)?;
    file.set_len(bytes.len() as u64)
}

/// What is wrong with a refusal.
fn fault_of(sentence: &str) -> Option<String> {
    let length = sentence.chars().count();
    if length == 0 || length > LONGEST_SENTENCE {
        return Some(format!("a refusal of {length} characters"));
    }
    let control = sentence.chars().find(|c| c.is_control());
    control.map(|c| format!("a refusal with a control character {c:?}: {sentence:?}"))
}

fn cut_places(length: usize) -> impl Iterator<Item = usize> {
    (0..length).step_by(length.div_ceil(MOST_CUTS).max(1))
}
