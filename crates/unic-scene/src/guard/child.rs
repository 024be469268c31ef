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
    if std::io::stdin().take(LONGEST_JOB).read_to_end(&mut bytes).is_err() {
        return 2;
    }
    let Ok(job) = postcard::from_bytes::<Job>(&bytes) else {
        return 2;
    };
    limit_memory(job.memory);
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

#[cfg(unix)]
fn limit_memory(bytes: u64) {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let most = getrlimit(Resource::As).maximum;
    let limit = Rlimit {
        current: Some(most.map_or(bytes, |most| bytes.min(most))),
        maximum: most,
    };
    // Without a limit the time and the length of the answer are still bounded.
    let _ = setrlimit(Resource::As, limit);
}

#[cfg(not(unix))]
fn limit_memory(_: u64) {}
