//! Reading in a child process, so that a file cannot bring the program down.
//!
//! ```no_run
//! use std::{env, process::{Command, ExitCode}};
//!
//! fn main() -> ExitCode {
//!     if env::args().nth(1).as_deref() == Some("read-scene") {
//!         return ExitCode::from(unic_scene::guard::serve());
//!     }
//!     let program = env::current_exe().unwrap();
//!     unic_scene::guard::use_child(move || {
//!         let mut command = Command::new(&program);
//!         command.arg("read-scene");
//!         command
//!     });
//!     // From here on, `unic_scene::read` reads in children.
//!     ExitCode::SUCCESS
//! }
//! ```

mod child;
mod parent;

pub use child::serve;

use crate::{Format, fault::Fault, request::Request, scene::Scene};
use serde::{Deserialize, Serialize};
use std::{
    ffi::OsString,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    process::Command,
    sync::OnceLock,
    time::Duration,
};

type MakeCommand = Box<dyn Fn() -> Command + Send + Sync>;

/// Time of a child for a file of any size, on a busy machine.
const TIME: Duration = Duration::from_secs(15);

/// Command whose process calls [`serve`], and the time that it has for a small file.
static CHILD: OnceLock<(MakeCommand, Duration)> = OnceLock::new();

/// Lets later readings happen in processes of the given command, which must call [`serve`]. Later
/// calls change nothing.
pub fn use_child(command: impl Fn() -> Command + Send + Sync + 'static) {
    use_child_within(TIME, command);
}

/// Does what [`use_child`] does, with another time for small files. Larger files get more.
pub fn use_child_within(time: Duration, command: impl Fn() -> Command + Send + Sync + 'static) {
    CHILD.get_or_init(|| (Box::new(command), time));
}

/// Job of a child: a file and the limits of its reading.
#[derive(Serialize, Deserialize)]
struct Job {
    path: OsString,
    format: Format,
    request: Request,
    /// Address space that the child may use, bytes.
    memory: u64,
    /// Computing time that the child may use.
    seconds: u64,
}

/// Answer of a child.
type Answer = Result<Scene, Fault>;

/// Reads a file in a child if there is a command for it, else here with panics caught.
pub(crate) fn read(path: &Path, format: Format, request: &Request) -> Result<Scene, Fault> {
    match CHILD.get() {
        Some((command, time)) => {
            let limits = Limits::of(path, format, *time);
            let job = Job {
                path: path.as_os_str().to_owned(),
                format,
                request: *request,
                memory: limits.memory,
                // Threads may compute at the same time; the parent's clock is the closer limit.
                seconds: limits.time.as_secs().saturating_add(1).saturating_mul(2),
            };
            match parent::ask(command(), &job, limits) {
                Some(answer) => answer,
                // Where no process can be started, as in a sandbox.
                None => caught(path, format, request),
            }
        }
        None => caught(path, format, request),
    }
}

/// Reads a file here; a panic becomes a fault.
fn caught(path: &Path, format: Format, request: &Request) -> Result<Scene, Fault> {
    // Nothing outlives the call that a panic could leave half changed.
    let outcome = catch_unwind(AssertUnwindSafe(|| crate::read_here(path, format, request)));
    outcome.unwrap_or_else(|_| Err(broken(format, "a damaged one, at which its reader stopped")))
}

fn broken(format: Format, found: impl Into<String>) -> Fault {
    let expected = match format {
        Format::Fbx => "an FBX file that can be read",
        Format::Usd => "a USD file that can be read",
    };
    Fault::new(expected, found)
}

/// Limits of a child, in proportion to its file.
#[derive(Clone, Copy)]
struct Limits {
    /// Address space, bytes.
    memory: u64,
    /// Length of the answer, bytes.
    answer: u64,
    time: Duration,
}

impl Limits {
    /// Address space for a file of any size: the program with its libraries, and files that a USD
    /// file refers to.
    const MEMORY: u64 = 2 << 30;
    /// Address space for each byte of the file: text and compressed data grow.
    const MEMORY_PER_BYTE: u64 = 64;
    const ANSWER: u64 = 256 << 20;
    /// Bytes of the file that are read in a second at least.
    const BYTES_PER_SECOND: u64 = 1 << 20;

    /// Bytes of the files beside a USD file that count at most: layers that it may refer to.
    const BESIDE: u64 = 8 << 30;

    fn of(path: &Path, format: Format, time: Duration) -> Self {
        // A missing file is reported by its reader.
        let own = std::fs::metadata(path).map_or(0, |file| file.len());
        let length = own.saturating_add(match format {
            Format::Usd => layers_beside(path).min(Self::BESIDE),
            Format::Fbx => 0,
        });
        let grown = length.saturating_mul(Self::MEMORY_PER_BYTE);
        Self {
            memory: grown.saturating_add(Self::MEMORY),
            answer: grown.saturating_add(Self::ANSWER),
            time: time.saturating_add(Duration::from_secs(length / Self::BYTES_PER_SECOND)),
        }
    }
}

/// Bytes of the USD files in the folder of a file, which may be its layers, itself left out.
fn layers_beside(path: &Path) -> u64 {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new(".")))
        .into_iter()
        .flatten()
        .flatten();
    let is_layer = |name: &Path| {
        let extension = name.extension().map(|e| e.to_string_lossy().to_lowercase());
        extension.is_some_and(|e| e.starts_with("usd")) && Some(name.as_os_str()) != path.file_name()
    };
    entries
        .filter(|entry| is_layer(Path::new(&entry.file_name())))
        .filter_map(|entry| Some(entry.metadata().ok()?.len()))
        .fold(0, u64::saturating_add)
}
