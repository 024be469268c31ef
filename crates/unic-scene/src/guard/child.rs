//! The process that reads.

use super::{Answer, Job, caught};
use std::{
    io::{Read, Write},
    path::Path,
};

/// Longest description of a job, bytes.
const LONGEST_JOB: u64 = 1 << 20;

/// Reads the file that the parent names on stdin, writes the scene to stdout and returns the exit
/// code. The process should do nothing else.
pub fn serve() -> u8 {
    let mut bytes = Vec::new();
    if std::io::stdin()
        .take(LONGEST_JOB)
        .read_to_end(&mut bytes)
        .is_err()
    {
        return 2;
    }
    let Ok(job) = postcard::from_bytes::<Job>(&bytes) else {
        return 2;
    };
    limit(job.memory, job.seconds);
    let answer: Answer = caught(Path::new(&job.path), job.format, &job.request);
    let Ok(bytes) = postcard::to_stdvec(&answer) else {
        return 2;
    };
    let mut out = std::io::stdout();
    match out.write_all(&bytes).and_then(|()| out.flush()) {
        Ok(()) => 0,
        Err(_) => 2,
    }
}

/// Limits memory and computing time. The parent watches the time too, unless it has ended itself.
#[cfg(unix)]
fn limit(memory: u64, seconds: u64) {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    for (resource, most) in [(Resource::As, memory), (Resource::Cpu, seconds)] {
        let maximum = getrlimit(resource).maximum;
        let limit = Rlimit {
            current: Some(maximum.map_or(most, |maximum| most.min(maximum))),
            maximum,
        };
        // Without a limit the parent's time and the length of the answer are still bounded.
        let _ = setrlimit(resource, limit);
    }
}

#[cfg(not(unix))]
fn limit(_: u64, _: u64) {}
