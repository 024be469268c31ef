//! Contract: the same rules hold for motions of every body.
//!
//! The bodies are a T-posed stick figure, the built-in human, and a body in an A-pose if its file
//! exists.

mod contact;
mod figure;
mod rhythm;
mod smooth;
mod vocabulary;
