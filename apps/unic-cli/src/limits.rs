//! Limits of this machine for sizes on the command line.
//!
//! Larger sizes are refused when the command line is parsed, before memory is allocated.

use std::{fs, num::NonZeroUsize, thread::available_parallelism};

/// Largest number of threads per processor. More would only wait for each other.
const THREADS_A_PROCESSOR: usize = 8;
/// Number of threads that every machine allows, so that results can be compared over many threads
/// on small machines too.
const FEWEST_THREADS: usize = 64;
/// Available memory in bytes that is assumed if the operating system does not give it.
const USUAL_MEMORY: u64 = 8 << 30;

/// Largest number of vertices of a garment with random weights. A frame of it takes seconds.
const MOST_VERTICES: u64 = 1_000_000;
/// Memory in bytes for each of these vertices, with mesh, body and networks.
const BYTES_A_VERTEX: u64 = 4096;

/// Largest number of vertices of a garment with random weights on this machine.
pub(crate) fn most_vertices() -> u64 {
    MOST_VERTICES.min(memory_bytes() / BYTES_A_VERTEX)
}

/// Largest number of threads to start on this machine.
pub(crate) fn most_threads() -> usize {
    let processors = available_parallelism().map_or(1, NonZeroUsize::get);
    (THREADS_A_PROCESSOR * processors).max(FEWEST_THREADS)
}

/// Number of bytes that a command may allocate: half of the available memory.
pub(crate) fn memory_bytes() -> u64 {
    available().unwrap_or(USUAL_MEMORY) / 2
}

/// Available memory in bytes, if the operating system gives it (Linux).
fn available() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_leave_room_for_work() {
        assert!(most_threads() >= FEWEST_THREADS);
        assert!(memory_bytes() > 1 << 20);
    }
}
