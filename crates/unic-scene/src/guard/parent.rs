//! The process that asks for a file to be read.

use super::{Answer, Job, Limits, broken};
use std::{
    io::{Read, Write},
    process::{Child, ChildStdout, Command, Stdio},
    sync::mpsc::{RecvTimeoutError, channel},
    thread,
};

/// Lets a child read a file; None if no process can be started.
pub(super) fn ask(mut command: Command, job: &Job, limits: Limits) -> Option<Answer> {
    let words = postcard::to_stdvec(job).ok()?;
    detach(&mut command);
    // The child's own messages would be a second report of the same fault.
    let child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let mut child = Reaped(child);
    let (mut stdin, stdout) = (child.0.stdin.take()?, child.0.stdout.take()?);
    // A child that ends before it has read its job is reported by its missing answer.
    let _ = stdin.write_all(&words);
    drop(stdin);
    Some(answer(stdout, job, limits))
}

/// Keeps Ctrl-C from the child: the program decides what it means, not the file that is read.
#[cfg(unix)]
fn detach(command: &mut Command) {
    std::os::unix::process::CommandExt::process_group(command, 0);
}

#[cfg(not(unix))]
fn detach(_: &mut Command) {}

/// Waits for the answer.
fn answer(stdout: ChildStdout, job: &Job, limits: Limits) -> Answer {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let read = stdout.take(limits.answer).read_to_end(&mut bytes);
        // Nobody listens after the time is up.
        let _ = sender.send(read.map(|_| bytes));
    });
    let bytes = match receiver.recv_timeout(limits.time) {
        Ok(Ok(bytes)) => bytes,
        Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => Vec::new(),
        Err(RecvTimeoutError::Timeout) => {
            let found = format!("one that is not read within {:.1} s", limits.time.as_secs_f32());
            return Err(broken(job.format, found));
        }
    };
    match postcard::take_from_bytes::<Answer>(&bytes) {
        Ok((answer, [])) => answer,
        _ if bytes.len() as u64 >= limits.answer => {
            Err(broken(job.format, "content out of proportion to its length"))
        }
        _ => Err(broken(
            job.format,
            "a damaged one, at which its reader ended or ran out of memory",
        )),
    }
}

/// Child that is ended when it is no longer needed.
struct Reaped(Child);

impl Drop for Reaped {
    fn drop(&mut self) {
        // A child that has ended already is waited for alone.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
