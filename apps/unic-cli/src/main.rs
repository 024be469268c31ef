//! The `unic` command.
fn main() {}
