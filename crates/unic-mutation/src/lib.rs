//! Mutation fuzzing of file readers: damaged files must be refused in a sentence or read.
//!
//! [`fuzz`] takes a valid file and a reader. It cuts the file short at every byte, then damages it
//! at random until the time is up: bits, bytes, counts, numbers in text, lines, and whole parts of
//! an archive, whose checksums are computed again. Every outcome must be a value or one sentence,
//! in bounded time and within [`MemoryLimit::OF_READERS`].
//!
//! The random stream of a reader is always the same; the time sets how many files are tried.
//!
//! | variable | meaning |
//! |---|---|
//! | `UNIC_MUTATION_SECONDS` | time for each reader's random damage, seconds (default 2) |
//! | `UNIC_MUTATION_SEED` | tries only the damaged file of this seed |
//!
//! A failure prints the seed and keeps the file. If the process is aborted, because memory ran out
//! or a reader did not return, the file that was being read remains in place.
//!
//! Memory is counted only in a program whose allocator is [`CountingAllocator`]:
//!
//! ```
//! use unic_mutation::{Container, CountingAllocator, FuzzTarget, fuzz, scratch_folder};
//!
//! #[global_allocator]
//! static ALLOCATOR: CountingAllocator = CountingAllocator;
//!
//! # fn main() {
//! # let folder = tempfile::tempdir().unwrap();
//! let path = scratch_folder(folder.path(), "text").join("valid.txt");
//! std::fs::write(&path, "a valid file").unwrap();
//! let target = FuzzTarget { name: "text", path: &path, container: Container::Plain };
//! let tally = fuzz(&target, |path| {
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
pub use heap::CountingAllocator;

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
use watch::Watchdog;

/// A valid file to damage, and the name of its reader.
#[derive(Clone, Copy, Debug)]
pub struct FuzzTarget<'a> {
    /// Name of the reader, which also selects the random stream and names the files that are kept.
    pub name: &'a str,
    /// Path of the file, which is damaged in place and restored at the end.
    pub path: &'a Path,
    /// Container format of the file.
    pub container: Container,
}

/// Numbers of outcomes for the damaged files of one reader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Files that were read: the damage was invisible or did not matter.
    pub read: usize,
    /// Files that were refused in a sentence.
    pub refused: usize,
    /// Largest cost of any file.
    pub max_cost: Cost,
}

impl Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            read,
            refused,
            max_cost,
        } = self;
        write!(
            f,
            "{} damaged files: {read} read, {refused} refused, at most {max_cost}",
            read + refused
        )
    }
}

/// Limit on the memory that a reader holds, in proportion to the size of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLimit {
    /// Bytes for each byte of the file.
    pub per_byte: usize,
    /// Bytes for a file of any size.
    pub fixed: usize,
}

impl MemoryLimit {
    /// Limit for all readers: decompression and conversion to larger types need a factor, buffers a
    /// fixed amount.
    pub const OF_READERS: Self = Self {
        per_byte: 64,
        fixed: 32 << 20,
    };
}

/// Memory and time of one reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Peak of the memory that it held, bytes.
    pub peak: usize,
    /// Wall time.
    pub time: Duration,
}

impl Cost {
    /// Returns true if the cost is in proportion to a file of `length` bytes.
    pub fn is_bounded(&self, length: usize) -> bool {
        let MemoryLimit { per_byte, fixed } = MemoryLimit::OF_READERS;
        self.peak <= per_byte * length + fixed && self.time <= LONGEST
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

/// Calls `read` and returns its value with the cost of the call.
pub fn measure<T>(read: impl FnOnce() -> T) -> (T, Cost) {
    let (start, before) = (Instant::now(), heap::mark());
    let value = read();
    let (peak, time) = (heap::peak_since(before), start.elapsed());
    (value, Cost { peak, time })
}

/// Longest time for reading a small file: far above any real one on a busy machine.
const LONGEST: Duration = Duration::from_secs(10);

/// Longest error message, characters: a message for people does not repeat a file to them.
const LONGEST_SENTENCE: usize = 1000;

/// Makes an empty folder for the files of one test.
///
/// It lies in `below`, a folder that outlasts the test, such as `CARGO_TARGET_TMPDIR`.
///
/// # Panics
/// Panics if the folder cannot be made.
pub fn scratch_folder(below: &Path, test: &str) -> PathBuf {
    let folder = below.join("mutations").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Number of damaged files that are tried.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Largest number of places at which a file, and each of its parts, is cut; shorter ones are cut at
    /// every byte.
    pub cuts: usize,
    /// Time for random damage, unless `UNIC_MUTATION_SECONDS` sets it.
    pub time: Duration,
}

impl Default for Effort {
    fn default() -> Self {
        Self {
            cuts: 4096,
            time: Duration::from_secs(2),
        }
    }
}

/// Reads damaged versions of a file as [`fuzz_with`] does, with the usual effort.
///
/// # Panics
/// When [`fuzz_with`] does.
pub fn fuzz(target: &FuzzTarget<'_>, read: impl FnMut(&Path) -> Result<(), String>) -> Tally {
    fuzz_with(target, Effort::default(), read)
}

/// Reads damaged versions of a file with `read`, which returns a sentence if it refuses one.
///
/// A reader should also use the value that it has read: a value that cannot be used is a failure
/// too.
///
/// # Panics
/// Panics if `read` refuses the valid file. Panics with the seed and the path of the damaged file
/// if `read` panics, takes too long, holds too much memory, or refuses without a valid sentence.
pub fn fuzz_with(
    target: &FuzzTarget<'_>,
    effort: Effort,
    mut read: impl FnMut(&Path) -> Result<(), String>,
) -> Tally {
    let valid = fs::read(target.path).unwrap();
    if let Err(sentence) = read(target.path) {
        panic!("{}: the valid file is refused: {sentence}", target.name);
    }
    let mut trial = Trial {
        target,
        effort,
        read: &mut read,
        watchdog: Watchdog::start(target.name.to_owned()),
        tally: Tally::default(),
    };
    match number("UNIC_MUTATION_SEED") {
        Some(seed) => trial.damage(&valid, seed),
        None => trial.all(&valid),
    }
    let tally = trial.tally;
    fs::write(target.path, valid).unwrap();
    eprintln!("{}: {tally}", target.name);
    tally
}

/// Number in an environment variable; `None` if it is not set or no number.
fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok().and_then(|text| text.parse().ok())
}

/// Trial of one reader.
struct Trial<'a> {
    target: &'a FuzzTarget<'a>,
    effort: Effort,
    read: &'a mut dyn FnMut(&Path) -> Result<(), String>,
    watchdog: Watchdog,
    tally: Tally,
}

impl Trial<'_> {
    /// Tries all cuts, then random damage until the time is up.
    fn all(&mut self, valid: &[u8]) {
        self.cuts(valid);
        let asked = number("UNIC_MUTATION_SECONDS").map(Duration::from_secs);
        let time = asked.unwrap_or(self.effort.time);
        let start = Instant::now();
        for seed in 0.. {
            if start.elapsed() >= time {
                return;
            }
            self.damage(valid, seed);
        }
    }

    /// Tries the file cut short, and each of its parts cut short in a valid container.
    fn cuts(&mut self, valid: &[u8]) {
        for end in cut_places(valid.len(), self.effort.cuts) {
            self.try_file(&valid[..end], &format!("cut-{end}"));
        }
        let parts = Parts::of(self.target.container, valid);
        for (i, part) in parts.contents().enumerate().filter(|_| parts.len() > 1) {
            for end in cut_places(part.len(), self.effort.cuts) {
                let bytes = parts.with(i, &part[..end]).bytes();
                self.try_file(&bytes, &format!("part-{i}-cut-{end}"));
            }
        }
    }

    /// Tries the damaged file of a seed.
    fn damage(&mut self, valid: &[u8], seed: u64) {
        let mut random = Random::new(self.target.name, seed);
        let bytes = container::damaged(self.target.container, valid, &mut random);
        self.try_file(&bytes, &format!("seed-{seed}"));
    }

    /// Writes the bytes, reads them and checks the outcome.
    fn try_file(&mut self, bytes: &[u8], label: &str) {
        overwrite(self.target.path, bytes).unwrap();
        self.watchdog.begin(label);
        let (outcome, cost) = measure(|| catch_unwind(AssertUnwindSafe(|| (self.read)(self.target.path))));
        let fault = match &outcome {
            Ok(Ok(())) => None,
            Ok(Err(sentence)) => fault_of(sentence),
            Err(_) => Some("a panic".into()),
        };
        let fault = fault.or_else(|| (!cost.is_bounded(bytes.len())).then(|| cost.to_string()));
        if let Some(fault) = fault {
            self.fail(bytes, label, &fault, outcome.err());
        }
        let max = &mut self.tally.max_cost;
        (max.peak, max.time) = (max.peak.max(cost.peak), max.time.max(cost.time));
        match outcome {
            Ok(Ok(())) => self.tally.read += 1,
            _ => self.tally.refused += 1,
        }
    }

    /// Keeps the damaged file beside the folder of the test and panics.
    fn fail(&self, bytes: &[u8], label: &str, fault: &str, panic: Option<Box<dyn Any + Send>>) -> ! {
        let FuzzTarget { name, path, .. } = self.target;
        let ending = path.file_name().unwrap_or_default().to_string_lossy();
        let kept = path.parent().unwrap().parent().unwrap();
        let kept = kept.join(format!("{name}-{label}-{ending}"));
        fs::write(&kept, bytes).unwrap();
        let message = format!("{name}, {label}: {fault}; the file is kept as {}", kept.display());
        eprintln!("{message}");
        match panic {
            Some(panic) => resume_unwind(panic),
            None => panic!("{message}"),
        }
    }
}

/// Replaces the contents of an existing file.
fn overwrite(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    // `fs::write` empties the file first. Some filesystems take that for the saving of a document
    // and wait for the disk, which is slow for thousands of files.
    let mut file = File::options().write(true).open(path)?;
    file.write_all(bytes)?;
    file.set_len(bytes.len() as u64)
}

/// Fault of an error message; `None` if it is one sentence without control characters.
fn fault_of(sentence: &str) -> Option<String> {
    let length = sentence.chars().count();
    if length == 0 || length > LONGEST_SENTENCE {
        return Some(format!("a refusal of {length} characters"));
    }
    let control = sentence.chars().find(|c| c.is_control());
    control.map(|c| format!("a refusal with a control character {c:?}: {sentence:?}"))
}

/// Evenly spaced lengths at which a file of `length` bytes is cut.
fn cut_places(length: usize, most: usize) -> impl Iterator<Item = usize> {
    (0..length).step_by(length.div_ceil(most).max(1))
}
