//! Options of an instance.

use crate::{
    axes::Axes,
    error::{Error, guard},
    job::{UnicParallelFor, WorkerThreads},
    memory::{Growing, Plain, read_sized, write_sized},
    pool::Pool,
    status::UnicStatus,
};
use std::{
    ffi::c_void,
    mem::{offset_of, size_of},
    sync::Arc,
};
use unic_core::{Corrects, IntersectionMode, Model, Precision, Threads, parallel::Serial};

/// Number format of the networks.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicPrecision {
    /// The fastest one of this processor whose error, as the model's training has measured it, is
    /// not above that of single precision by more than precision_error. By the features of the
    /// processor and never by timing: a machine gives the same bits on every run.
    Auto = 0,
    /// Single precision.
    F32 = 1,
    /// bfloat16.
    Bf16 = 2,
    /// 16-bit integers.
    Int16 = 3,
    /// 8-bit integers.
    Int8 = 4,
}

impl From<Precision> for UnicPrecision {
    fn from(precision: Precision) -> Self {
        match precision {
            Precision::F32 => Self::F32,
            Precision::Bf16 => Self::Bf16,
            Precision::Int16 => Self::Int16,
            Precision::Int8 => Self::Int8,
        }
    }
}

/// Handling of garment vertices inside the body.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicIntersection {
    /// The rule that the model was made with.
    Model = 0,
    /// Vertices inside the body stay there.
    Off = 1,
    /// Rule of the paper: to a distance over the nearest body vertex, in the state.
    Paper = 2,
    /// Shown vertices leave the body and the colliders the shortest way. The state stays.
    Robust = 3,
    /// The same, and the state is corrected too. For models that are trained with it.
    RobustState = 4,
}

/// Axes and unit of everything that an instance takes and gives.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicAxes {
    /// Right-handed, +Y up, the character faces +Z, metres. glTF and Godot have the same.
    Model = 0,
    /// Left-handed, +Y up, the character faces +Z, metres.
    Unity = 1,
    /// Left-handed, +Z up, the character faces +X, centimetres.
    Unreal = 2,
    /// Right-handed, +Z up, the character faces -Y, metres.
    Blender = 3,
    /// Those of custom_axes and metres_per_unit.
    Custom = 4,
}

/// Vertices that are written.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicVertexLayout {
    /// Those of the model, in its order.
    Model = 0,
    /// Those of the model, followed by copies of vertices at texture seams, so that each vertex has
    /// one texture coordinate.
    Split = 1,
}

/// Threads that a call works on.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicThreads {
    /// The calling thread alone.
    None = 0,
    /// The calling thread and workers of the library. Instances with the same thread_count share
    /// the workers; a call that finds them at work for another instance runs on its own thread.
    Pool = 1,
    /// Those of the caller, by parallel_for.
    Caller = 2,
}

/// Options of an instance. unic_options_init sets the defaults. Zero is the default of every option.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct UnicOptions {
    /// Size of the struct in bytes. unic_options_init sets it.
    pub size: u32,
    /// A UnicPrecision.
    pub precision: u32,
    /// Share of the vertices at which the networks are evaluated, above 0 to 1; the others are
    /// interpolated. For fine meshes and distant characters. 0, the default: that of the model's
    /// file, which is 1 unless it was made for a time budget.
    pub sampling: f32,
    /// A UnicIntersection.
    pub intersection: u32,
    /// Distance that intersection handling keeps, in metres whatever the unit. 0, the default: the
    /// usual one, 0.003 for the robust rules and 0.005 for the paper's. Where a strain projection
    /// sweeps the garment after the handling, vertices keep at least half of it.
    pub intersection_distance_m: f32,
    /// A UnicAxes.
    pub axes: u32,
    /// For UNIC_AXES_CUSTOM: the number, from 1, of the caller's axis that points to the character's
    /// left, up and ahead, in this order; negative if it points the other way. Unity: -1, 2, 3.
    /// Zeros, the default: 1, 2, 3.
    pub custom_axes: [i32; 3],
    /// Metres of a unit of the caller, 1e-6 to 1e6; 0, the default: that of the axes.
    pub metres_per_unit: f32,
    /// A UnicVertexLayout.
    pub vertex_layout: u32,
    /// A UnicThreads.
    pub threads: u32,
    /// Number of threads that work at the same time, the calling one included, at most 256. 0: as
    /// many as the machine has processors, at most 256.
    pub thread_count: u32,
    /// Share, 0 to 1, by which the error that UNIC_PRECISION_AUTO chooses by may exceed that of
    /// single precision. 0, the default: 0.01.
    pub precision_error: f32,
    /// For UNIC_THREADS_CALLER.
    pub parallel_for: UnicParallelFor,
    /// First argument of parallel_for.
    pub parallel_context: *mut c_void,
}

// SAFETY: numbers, a nullable function pointer and a pointer. The fields before the pointers are 14
// of 4 bytes, so that there is no padding.
unsafe impl Plain for UnicOptions {}
const _: () = assert!(
    size_of::<UnicOptions>() == 14 * 4 + 2 * size_of::<usize>(),
    "padding"
);

impl Growing for UnicOptions {
    const FIRST_SIZE: usize = offset_of!(Self, parallel_context) + size_of::<usize>();
}

impl Default for UnicOptions {
    fn default() -> Self {
        Self {
            size: size_of::<Self>() as u32,
            precision: UnicPrecision::Auto as u32,
            sampling: 0.0,
            intersection: UnicIntersection::Model as u32,
            intersection_distance_m: 0.0,
            axes: UnicAxes::Model as u32,
            custom_axes: [0; 3],
            metres_per_unit: 0.0,
            vertex_layout: UnicVertexLayout::Model as u32,
            threads: UnicThreads::None as u32,
            thread_count: 0,
            precision_error: 0.0,
            parallel_for: None,
            parallel_context: std::ptr::null_mut(),
        }
    }
}

/// Sets the defaults. `size` is `sizeof(UnicOptions)` of the caller.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_options_init(options: *mut UnicOptions, size: u32) -> UnicStatus {
    guard(|| {
        // SAFETY: memory of `size` bytes, by the contract of all functions.
        unsafe { write_sized("options", options, size, UnicOptions::default()) }
    })
}

/// Options, checked.
#[derive(Debug)]
pub(crate) struct Options {
    pub(crate) precision: PrecisionChoice,
    /// None for that of the model.
    pub(crate) sampling: Option<f32>,
    /// None for that of the model.
    pub(crate) intersection: Option<IntersectionMode>,
    pub(crate) axes: Axes,
    pub(crate) vertex_layout: UnicVertexLayout,
    pub(crate) threads: Arc<dyn Threads>,
}

impl Options {
    /// Checks the caller's options; null stands for the defaults.
    ///
    /// # Safety
    /// `options` is null, misaligned or points to a struct of the size that it states.
    pub(crate) unsafe fn read(options: *const UnicOptions) -> Result<Self, Error> {
        let given = match options.is_null() {
            true => UnicOptions::default(),
            // SAFETY: passed on.
            false => unsafe { read_sized("options", options) }?,
        };
        let allowed = given.precision_error;
        if !(0.0..=1.0).contains(&allowed) {
            return Err(Error::value("precision_error", "0 to 1", allowed));
        }
        if !(0.0..=1.0).contains(&given.sampling) {
            return Err(Error::value("sampling", "0 to 1", given.sampling));
        }
        Ok(Self {
            precision: precision(given.precision, allowed)?,
            sampling: (given.sampling != 0.0).then_some(given.sampling),
            intersection: intersection(given.intersection, given.intersection_distance_m)?,
            axes: Axes::new(given.axes, given.custom_axes, given.metres_per_unit)?,
            vertex_layout: vertex_layout(given.vertex_layout)?,
            threads: threads(&given)?,
        })
    }
}

/// Number format of the networks, which for some depends on the model.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PrecisionChoice {
    /// Fastest one whose error exceeds that of f32 by at most this share.
    Auto(f64),
    /// This one.
    Named(Precision),
}

impl PrecisionChoice {
    /// Number format for a model.
    pub(crate) fn of(self, model: &Model) -> Precision {
        match self {
            Self::Auto(allowed) => model.fastest_precision(allowed),
            Self::Named(precision) => precision,
        }
    }
}

/// Choice of a value of [`UnicPrecision`]. `allowed` is the caller's share, or 0.
fn precision(given: u32, allowed: f32) -> Result<PrecisionChoice, Error> {
    if given == UnicPrecision::Auto as u32 {
        return Ok(PrecisionChoice::Auto(match allowed {
            0.0 => Model::ALLOWED_PRECISION_ERROR,
            share => share.into(),
        }));
    }
    named_precision(given).map(PrecisionChoice::Named)
}

/// Number format of a value of [`UnicPrecision`] that names one.
pub(crate) fn named_precision(given: u32) -> Result<Precision, Error> {
    let all = [
        (UnicPrecision::F32, Precision::F32),
        (UnicPrecision::Bf16, Precision::Bf16),
        (UnicPrecision::Int16, Precision::Int16),
        (UnicPrecision::Int8, Precision::Int8),
    ];
    let found = all.into_iter().find(|(p, _)| *p as u32 == given);
    let unknown = || Error::value("precision", "a value of UnicPrecision", given);
    found.map(|(_, precision)| precision).ok_or_else(unknown)
}

fn intersection(given: u32, distance_m: f32) -> Result<Option<IntersectionMode>, Error> {
    if !(distance_m >= 0.0 && distance_m.is_finite()) {
        return Err(Error::value("intersection_distance_m", "at least 0", distance_m));
    }
    let or = |usual: f32| if distance_m == 0.0 { usual } else { distance_m };
    let robust = |corrects| IntersectionMode::Robust {
        margin_m: or(IntersectionMode::MARGIN_M),
        corrects,
    };
    let paper = IntersectionMode::Paper {
        relaxation_m: or(IntersectionMode::RELAXATION_M),
    };
    let all = [
        (UnicIntersection::Model, None),
        (UnicIntersection::Off, Some(IntersectionMode::Off)),
        (UnicIntersection::Paper, Some(paper)),
        (UnicIntersection::Robust, Some(robust(Corrects::Display))),
        (UnicIntersection::RobustState, Some(robust(Corrects::State))),
    ];
    let found = all.into_iter().find(|(i, _)| *i as u32 == given);
    let unknown = || Error::value("intersection", "a value of UnicIntersection", given);
    found.map(|(_, mode)| mode).ok_or_else(unknown)
}

fn vertex_layout(given: u32) -> Result<UnicVertexLayout, Error> {
    let all = [UnicVertexLayout::Model, UnicVertexLayout::Split];
    let found = all.into_iter().find(|l| *l as u32 == given);
    found.ok_or_else(|| Error::value("vertex_layout", "a value of UnicVertexLayout", given))
}

/// Largest number of threads of one call.
const MOST_THREADS: u32 = 256;

fn threads(given: &UnicOptions) -> Result<Arc<dyn Threads>, Error> {
    if given.thread_count > MOST_THREADS {
        return Err(Error::value("thread_count", "at most 256", given.thread_count));
    }
    let count = match given.thread_count {
        0 => std::thread::available_parallelism().map_or(1, |n| n.get().min(MOST_THREADS as usize)),
        given => given as usize,
    };
    if given.threads == UnicThreads::None as u32 {
        return Ok(Arc::new(Serial));
    }
    if given.threads == UnicThreads::Pool as u32 {
        return Ok(Pool::shared(count)?);
    }
    if given.threads != UnicThreads::Caller as u32 {
        return Err(Error::value("threads", "a value of UnicThreads", given.threads));
    }
    let parallel_for = given.parallel_for.ok_or(Error::Null { what: "parallel_for" })?;
    Ok(Arc::new(WorkerThreads::new(
        count,
        parallel_for,
        given.parallel_context,
    )))
}
