//! The C interface of neural garments, for every engine that can load a library.
//!
//! C programs include `include/unic.h`, which is made from this crate. The names are the same in
//! both, and `docs/engines.md` has a complete program.
//!
//! # Design
//!
//! - **Handles.** A [`UnicModel`] is a trained garment. It never changes, has a number of owners,
//!   and serves all threads. A [`UnicInstance`] is one garment in motion. Handles look like pointers
//!   but are numbers that are looked up. A handle that was released, or never made, is therefore an
//!   error and not a stray access.
//! - **Codes.** Functions return a [`UnicStatus`]. [`unic_last_error`] has the sentence for the last
//!   error of the calling thread. A call that fails changes nothing; [`unic_instance_save`] alone
//!   writes the size that a buffer must have.
//! - **Panics** are caught at every function ([`UnicStatus::Panic`]) and written to the standard
//!   error. The instance can then only be released.
//! - **Threads.** Models serve all threads. An instance is for one thread at a time: a second one
//!   gets [`UnicStatus::InUse`]. A call works on the calling thread, on workers of the library, or
//!   on those of the caller ([`UnicThreads`]). The results are the same bytes.
//! - **Memory.** Results are written to buffers of the caller, with strides in bytes, so that a
//!   vertex buffer is filled in place. After the first few steps, a step allocates nothing.
//! - **Axes and units** are options of an instance ([`UnicAxes`]). Poses, results, colliders, wind
//!   and faces are converted, so that no engine mirrors anything by itself.
//! - **Growth.** Structs that may grow begin with their size in bytes, which the caller sets. Fields
//!   that a program compiled with an earlier header does not have count as zero, which is the default
//!   of every field. A program that was
//!   compiled with a later header works here if the fields that this version does not know are zero;
//!   in structs that it asks for, they become zero. [`UNIC_ABI_VERSION`] changes when older programs
//!   stop working.
//!
//! # Rules for pointers
//!
//! The library checks null, alignment, counts, strides, numbers and values of enumerations. It
//! cannot see whether memory is as large as stated. Callers promise for every function:
//!
//! - a pointer that is not null points to memory of the type and the number that the function's
//!   description states, and nobody else changes that memory during the call;
//! - strides lead to rows within that memory;
//! - texts end with a zero byte;
//! - a callback can be called on every thread that uses the instance and does not throw.
//!
//! # The header
//!
//! `include/unic.h` is made by cbindgen from these sources. A test compares it with them; this
//! command writes it anew:
//!
//! ```sh
//! UNIC_WRITE_HEADER=1 cargo test --release -p unic-ffi --test header
//! ```

#![allow(
    clippy::missing_safety_doc,
    reason = "the same promises hold for all functions: `Rules for pointers` above"
)]

mod axes;
mod collider;
mod error;
mod instance;
mod job;
mod memory;
mod mesh;
mod model;
mod options;
mod pool;
mod pose;
mod queries;
mod registry;
mod state;
mod status;
mod step;
mod version;

pub use collider::{UnicCollider, UnicShape};
pub use error::unic_last_error;
pub use instance::{
    UnicInstance, unic_instance_create, unic_instance_precision, unic_instance_release,
    unic_instance_set_colliders,
};
pub use job::{UnicJob, UnicParallelFor};
pub use mesh::{UnicMesh, UnicVertices};
pub use model::{
    UnicModel, UnicModelInfo, unic_model_from_bytes, unic_model_from_path, unic_model_info,
    unic_model_joint_name, unic_model_joint_parents, unic_model_release, unic_model_retain,
};
pub use options::{
    UnicAxes, UnicIntersection, UnicOptions, UnicPrecision, UnicThreads, UnicVertexLayout, unic_options_init,
};
pub use pose::{UnicPose, UnicRoot, UnicRotations, UnicStepInput};
pub use queries::{
    UnicMeshInfo, unic_instance_mesh_faces, unic_instance_mesh_info, unic_instance_mesh_sources,
    unic_instance_mesh_uvs, unic_instance_rest_joints,
};
pub use state::{unic_instance_restore, unic_instance_save};
pub use status::{UnicStatus, unic_status_name};
pub use step::{
    unic_instance_body, unic_instance_display, unic_instance_reset, unic_instance_reset_to,
    unic_instance_step,
};
pub use version::{
    UNIC_ABI_VERSION, UnicFeature, unic_abi_version, unic_features, unic_instructions, unic_version,
};
