//! Cloth simulation on animated bodies: the physics that makes training data.
//!
//! A [`Cloth`] is built once from a rest mesh and a [`Material`]; any number of [`Simulation`]s share
//! it. On a character, [`Simulation::settle`] begins a clip from the rest shape and
//! [`Simulation::step_frame`] goes from pose to pose.
//!
//! ```
//! use glam::Vec3;
//! use std::sync::Arc;
//! use unic_core::mesh::TriMesh;
//! use unic_sim::{Cloth, ClothSpec, Material, Simulation, SimulationSettings};
//!
//! // A handkerchief of 20 cm, held at one corner.
//! let place = |i: u32| Vec3::new((i % 21) as f32, 0.0, (i / 21) as f32) * 0.01;
//! let squares = (0..20).flat_map(|z| (0..20).map(move |x| 21 * z + x));
//! let faces = squares.flat_map(|a: u32| [[a, a + 21, a + 1], [a + 1, a + 21, a + 22]]);
//! let mesh = TriMesh::new((0..441).map(place).collect(), faces.collect())?;
//! let spec = ClothSpec { pins: vec![0], ..ClothSpec::new(mesh, Material::SILK) };
//! let cloth = Arc::new(Cloth::new(&spec)?);
//!
//! let mut simulation = Simulation::new(cloth, SimulationSettings::default())?;
//! for _frame in 0..30 {
//!     simulation.step_still(Vec3::X * 0.5)?; // a breeze, m/s
//! }
//! let corner = simulation.vertices()[440];
//! assert!(corner.y < -0.2 && corner.length() < 0.29);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! On a character:
//!
//! ```no_run
//! # use glam::Vec3;
//! # use std::sync::Arc;
//! # use unic_core::{character::Character, clip::Clip, mesh::TriMesh};
//! # use unic_sim::{Cloth, ClothSpec, Material, Simulation, SimulationSettings};
//! # fn run(garment: TriMesh, character: Arc<Character>, clip: Clip) -> Result<(), Box<dyn std::error::Error>> {
//! let cloth = Arc::new(Cloth::new(&ClothSpec::new(garment, Material::COTTON))?);
//! let settings = SimulationSettings { fps: clip.fps, ..Default::default() };
//! let mut simulation = Simulation::on_character(cloth, character, settings)?;
//! let mut frames = vec![simulation.settle(&clip.poses[0], &clip.poses[1])?.to_vec()];
//! for pose in &clip.poses[1..] {
//!     frames.push(simulation.step_frame(pose, Vec3::ZERO)?.to_vec());
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # How it works
//!
//! Extended position-based dynamics with small steps (Macklin et al. 2019): 20 steps a frame by
//! default, each with one Gauss-Seidel sweep over all constraints.
//!
//! - **Stretch**: three Green strains a triangle, along warp and weft and in shear.
//! - **Bending**: the angle at each edge, from the angle that it has at rest.
//! - **Aggregates**: coarse groups of particles that may not part farther than the cloth between them
//!   is long; they carry the weight of long fine garments, which triangle after triangle would
//!   stretch like rubber.
//! - **Soundness**: [`soundness`] counts penetration, strain and creeping of what came out.
//! - **Contact**: [`contact`] with the [`body`] and the ground, [`self_contact`] of the cloth, both with
//!   Coulomb friction.
//! - [`Air`]: drag of still air and wind, by triangle.
//!
//! Constraints that share no particle are solved eight at a time and by all threads of the current
//! rayon pool. The same inputs give the same bytes for any number of threads.
//!
//! # Conventions
//!
//! Metres, kilograms, seconds, radians, f32; +Y up. Rest shapes are in the character's bind-pose
//! space, everything else in world space. [`Cloth`] is an asset, [`Particles`] are state, the rest of a
//! [`Simulation`] is scratch.
//!
//! # Limits
//!
//! Steps are of first order and damp fast oscillation. With one sweep a step, a constraint is at most as
//! stiff as inertia lets it be: stretch is helped by the aggregates, bending is not. On triangles of
//! side h, bending keeps its stiffness B while B Δt² is well below some 0.03 · density · h⁴: 20 steps a
//! frame do for cotton from 1 cm upwards; denim or finer triangles want more, or hang softer than they
//! are. Cloth does not harden, tear or keep creases.

mod aggregate;
mod air;
pub mod body;
mod cloth;
mod colouring;
mod constraint;
pub mod contact;
mod error;
mod lanes;
mod material;
mod particles;
pub mod self_contact;
mod simulation;
pub mod soundness;

pub use air::Air;
pub use cloth::{Attachment, Cloth, ClothError, ClothSpec};
pub use error::SimulationError;
pub use material::Material;
pub use particles::Particles;
pub use simulation::{SettleSettings, Simulation, SimulationSettings};
