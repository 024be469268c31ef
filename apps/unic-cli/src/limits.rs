//! Limits of this machine: sizes on the command line beyond them are refused before memory is asked for.

use std::{fs, num::NonZeroUsize, thread::available_parallelism};

/// Threads for each processor: more only wait for each other.
const THREADS_A_PROCESSOR: usize = 8;
/// Machines with few processors may still be asked how results do not depend on threads.
const FEWEST_THREADS: usize = 64;
/// Memory where the system does not tell, bytes.
const USUAL_MEMORY: u64 = 8 << 30;

/// Vertices of a garment that is measured with random weights: one that takes seconds a frame.
const MOST_VERTICES: u64 = 1_000_000;
/// Memory for each of them, with mesh, body and networks.
const BYTES_A_VERTEX: u64 = 4096;

/// Most vertices of such a garment on this machine.
pub(crate) fn most_vertices() -> u64 {
    MOST_VERTICES.min(memory_bytes() / BYTES_A_VERTEX)
}

/// Most threads that this machine is asked to start.
pub(crate) fn most_threads() -> usize {
    let processors = available_parallelism().map_or(1, NonZeroUsize::get);
    (THREADS_A_PROCESSOR * processors).max(FEWEST_THREADS)
}

/// Bytes that may be taken at once: half of what is free.
pub(crate) fn memory_bytes() -> u64 {
    available().unwrap_or(USUAL_MEMORY) / 2
}

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
