//! Time of reading a model from its bytes, with and without the comparison of its checksum.
//!
//! It prints the shortest of several rounds: other programs make a round slower, never faster.
//!
//! ```text
//! cargo run --release -p unic-core --example load_time              # random, paper's sizes
//! cargo run --release -p unic-core --example load_time 62461        # random, standard
//! cargo run --release -p unic-core --example load_time garment.unic
//! ```

use std::{error::Error, hint::black_box, time::Instant};
use unic_builtin::scale::{NetworkSize, VERTICES, random_model};
use unic_core::{
    Model,
    model_file::{Integrity, verify_checksum},
};

const ROUNDS: usize = 21;

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let model = match std::env::args().nth(1) {
        Some(argument) => match argument.parse() {
            Ok(vertices) => random_model(NetworkSize::Standard, vertices)?,
            Err(_) => Model::from_bytes(&std::fs::read(argument)?)?,
        },
        None => random_model(NetworkSize::Paper, VERTICES[0])?,
    };
    // The file is written again, because it may lack a checksum.
    let bytes = model.to_bytes()?;
    println!("a model of {:.1} MB", bytes.len() as f64 / 1e6);
    let checksum = milliseconds(|| verify_checksum(&bytes).map(drop))?;
    println!("the checksum alone: {checksum:.2} ms");
    for integrity in [Integrity::Check, Integrity::Skip] {
        let load = milliseconds(|| Model::from_bytes_with(&bytes, integrity).map(|m| drop(black_box(m))))?;
        println!("reading, {integrity:?}: {load:.2} ms");
    }
    Ok(())
}

/// Returns the shortest time of `work`, milliseconds.
fn milliseconds<E>(mut work: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let mut shortest = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        work()?;
        shortest = shortest.min(1e3 * start.elapsed().as_secs_f64());
    }
    Ok(shortest)
}
