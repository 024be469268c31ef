//! Contract of motion matching: features have their closed-form values and one scale a group,
//! mirrored clips are mirror images, the fast search finds the frame of the naive one, switches are
//! continuous, locked feet stand, commands are followed from a stand, files and states come back
//! bit for bit, and a step allocates nothing.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;
mod control;
mod database;
mod file;
mod search;
