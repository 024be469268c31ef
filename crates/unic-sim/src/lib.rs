//! Cloth simulation on animated bodies: the physics that makes training data.
//!
//! A [`Cloth`] is built once from a rest mesh and a [`Material`]; any number of [`Simulation`]s
//! share it. On a character, [`Simulation::settle`] brings the garment from its rest shape to the
//! first frame of a clip. [`Simulation::step_frame`] then advances it by one pose at a time.
//!
//! ```
//! use glam::Vec3;
//! use std::sync::Arc;
//! use unic_core::mesh::TriMesh;
//! use unic_sim::{Cloth, ClothSpec, Material, Simulation, SimulationSettings};
//!
//! // A handkerchief of 20 cm, pinned at one corner.
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
//! # type Result = std::result::Result<(), Box<dyn std::error::Error>>;
//! # fn run(garment: TriMesh, character: Arc<Character>, clip: Clip) -> Result {
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
//! - **Stretch**: three Green strains per triangle, along warp and weft and in shear.
//! - **Bending**: the dihedral angle at each edge, relative to its rest angle.
//! - **Long-range limits**: coarse particles, each a weighted group of particles. Two of them may
//!   not be farther apart than the cloth between them is long. One sweep over the triangles alone
//!   would let long fine garments stretch like rubber under their own weight.
//! - **Contact**: [`contact`] with the [`body`] and the ground, and [`self_contact`] of the cloth.
//!   Both have Coulomb friction.
//! - [`Air`]: drag of still air and wind, per triangle.
//!
//! Constraints that share no particle are solved eight at a time, by all threads of the current
//! rayon pool. The same inputs give the same bytes for any number of threads.
//!
//! [`quality`] measures penetration, strain and creep of simulated clips.
//!
//! # Conventions
//!
//! Metres, kilograms, seconds, radians, f32; +Y up. Rest shapes are in the character's bind-pose
//! space, everything else is in world space. [`Cloth`] is an asset, [`Particles`] are state, the
//! rest of a [`Simulation`] is scratch.
//!
//! # Limits
//!
//! Time integration is of first order and damps fast oscillation. With one sweep per step, the
//! effective stiffness of a constraint is limited by inertia. The long-range limits compensate for
//! this in stretch, but nothing does in bending. On triangles of side h, bending keeps its
//! stiffness B while B Δt² is well below 0.03 · density · h⁴. Twenty steps a frame suffice for
//! cotton with triangles of 1 cm and more. Denim or finer triangles need more steps, or drape too
//! softly. Cloth does not harden, tear or keep creases.

mod air;
pub mod body;
mod cloth;
mod constraint;
pub mod contact;
mod error;
mod long_range;
mod material;
mod particles;
pub mod quality;
pub mod self_contact;
mod simd;
mod simulation;

pub use air::Air;
pub use cloth::{Attachment, Cloth, ClothError, ClothSpec, ConstraintCounts};
pub use error::SimulationError;
pub use material::Material;
pub use particles::Particles;
pub use simulation::{SettleSettings, Simulation, SimulationSettings};
