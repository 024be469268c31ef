//! A device, and the few ways in which it is used here.

use crate::{GpuError, Precision};
use half::f16;
use wgpu::{
    Adapter, Buffer, BufferUsages, CooperativeScalarType, Device, ExperimentalFeatures, Features, Queue,
    util::DeviceExt,
};

/// A device and its queue: cheap to clone, shared by all that is made on it.
#[derive(Clone, Debug)]
pub struct GpuContext {
    device: Device,
    queue: Queue,
    matrix_units: Option<MatrixUnits>,
}

/// Matrices of halves that a device multiplies and adds up in single precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MatrixUnits {
    /// Rows and columns of each.
    pub(crate) side: usize,
    /// Most invocations that hold one together.
    pub(crate) largest_subgroup: usize,
}

impl MatrixUnits {
    const FEATURES: Features = Features::EXPERIMENTAL_COOPERATIVE_MATRIX
        .union(Features::SUBGROUP)
        .union(Features::SHADER_F16);

    /// The largest of an adapter.
    fn of(adapter: &Adapter) -> Option<Self> {
        let info = adapter.get_info();
        let sizes = adapter.cooperative_matrix_properties().into_iter();
        let fitting = sizes.filter(|size| {
            (size.ab_type, size.cr_type) == (CooperativeScalarType::F16, CooperativeScalarType::F32)
                && (size.m_size, size.n_size) == (size.k_size, size.k_size)
        });
        let side = fitting.map(|size| size.k_size as usize).max()?;
        adapter.features().contains(Self::FEATURES).then_some(Self {
            side,
            largest_subgroup: info.subgroup_max_size as usize,
        })
    }
}

impl GpuContext {
    /// The features that kernels and timings make use of where an adapter has them. A caller who
    /// brings a device requests what it wants of these.
    pub const USEFUL_FEATURES: Features = Features::SHADER_F16.union(Features::TIMESTAMP_QUERY);

    /// The fastest adapter of this machine; the environment variable `WGPU_BACKEND` narrows the choice.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] without one, [`GpuError::Device`] when it gives no device.
    pub fn new() -> Result<Self, GpuError> {
        let adapter = fastest_adapter()?;
        Self::of(&adapter, None)
    }

    /// The same with the adapter's matrix units, if it has any, for [`Precision::F16Matrix`].
    ///
    /// They are an experimental feature of wgpu, whose bugs could be undefined behaviour that no caller prevents:
    /// that is why they have to be asked for. Where subgroups of a device differ in size, a workgroup has
    /// as many invocations as it needs of the largest, and some idle.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_matrix_units() -> Result<Self, GpuError> {
        let adapter = fastest_adapter()?;
        Self::of(&adapter, MatrixUnits::of(&adapter))
    }

    fn of(adapter: &Adapter, matrix_units: Option<MatrixUnits>) -> Result<Self, GpuError> {
        let (features, experimental_features) = match matrix_units {
            None => (Features::empty(), ExperimentalFeatures::disabled()),
            // SAFETY: the caller asked for what may hold bugs of wgpu. The kernels load and store whole matrices within
            // their buffers; that subgroups are full, as many as the workgroup holds, and see each other's memory
            // behind a barrier is the driver's and wgpu's part.
            Some(_) => (MatrixUnits::FEATURES, unsafe { ExperimentalFeatures::enabled() }),
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("unic"),
            required_features: adapter.features() & Self::USEFUL_FEATURES | features,
            required_limits: adapter.limits(),
            experimental_features,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::Device(e.to_string()))?;
        Ok(Self {
            device,
            queue,
            matrix_units,
        })
    }

    /// The caller's own device and queue, so that what is computed can be drawn where it is; without matrix units.
    pub fn from_device(device: Device, queue: Queue) -> Self {
        Self {
            device,
            queue,
            matrix_units: None,
        }
    }

    /// Has it matrix units, for [`Precision::F16Matrix`]?
    pub fn has_matrix_units(&self) -> bool {
        self.matrix_units.is_some()
    }

    pub(crate) fn needed_matrix_units(&self) -> Result<MatrixUnits, GpuError> {
        self.matrix_units.ok_or(GpuError::Feature {
            what: "a field on matrix units",
            feature: "EXPERIMENTAL_COOPERATIVE_MATRIX",
        })
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Its queue: what is submitted to it after a step sees the step's garment.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// Name of the adapter and its driver.
    pub fn adapter_name(&self) -> String {
        let info = self.device.adapter_info();
        format!("{} ({} {})", info.name, info.driver, info.driver_info)
    }

    /// Does it have all of these features?
    pub fn has(&self, features: Features) -> bool {
        self.device.features().contains(features)
    }

    /// Blocks until all submitted work is done.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn wait(&self) -> Result<(), GpuError> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        polled.map(|_| ()).map_err(|e| GpuError::Device(e.to_string()))
    }

    /// Runs `make`, which creates things on the device: what the device refuses is an error and no panic.
    pub(crate) fn checked<T>(&self, make: impl FnOnce() -> Result<T, GpuError>) -> Result<T, GpuError> {
        let scopes = [
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Internal,
            wgpu::ErrorFilter::Validation,
        ]
        .map(|filter| self.device.push_error_scope(filter));
        let made = make();
        // All of them, the last one first, whatever they hold.
        let errors = scopes
            .into_iter()
            .rev()
            .map(|scope| pollster::block_on(scope.pop()));
        match errors.fold(None, Option::or) {
            Some(error) => Err(GpuError::Device(error.to_string())),
            None => made,
        }
    }

    /// A storage buffer that holds `contents`, which may be empty.
    pub(crate) fn upload<T: bytemuck::NoUninit>(&self, label: &str, contents: &[T]) -> Buffer {
        self.filled(label, contents, BufferUsages::STORAGE | BufferUsages::COPY_DST)
    }

    /// A storage buffer of weights, in halves where the precision has them so.
    pub(crate) fn upload_weights(&self, label: &str, precision: Precision, weights: &[f32]) -> Buffer {
        match precision {
            Precision::F32 => self.upload(label, weights),
            Precision::F16 | Precision::F16Matrix => {
                let halves: Vec<u16> = weights.iter().map(|&w| f16::from_f32(w).to_bits()).collect();
                self.upload(label, &halves)
            }
        }
    }

    /// A uniform buffer.
    pub(crate) fn uniform<T: bytemuck::NoUninit>(&self, label: &str, contents: &T) -> Buffer {
        self.filled(label, std::slice::from_ref(contents), BufferUsages::UNIFORM)
    }

    fn filled<T: bytemuck::NoUninit>(&self, label: &str, contents: &[T], usage: BufferUsages) -> Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            // A binding holds an element at least.
            contents: if bytes.is_empty() { &[0; 32] } else { bytes },
            usage,
        })
    }

    /// A storage buffer of zeros.
    pub(crate) fn zeroed(&self, label: &str, bytes: usize, usage: BufferUsages) -> Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.max(32).next_multiple_of(4) as u64,
            usage: usage | BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    }

    /// Blocks until the device has done its work and returns `bytes` of a buffer, from byte `from` on.
    pub(crate) fn download(&self, buffer: &Buffer, from: u64, bytes: u64) -> Result<Vec<u8>, GpuError> {
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: bytes,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, from, &staging, 0, bytes);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver lives until it has the answer.
            let _ = sender.send(result);
        });
        self.wait()?;
        let lost = |e: &dyn std::fmt::Display| GpuError::Device(e.to_string());
        receiver.recv().map_err(|e| lost(&e))?.map_err(|e| lost(&e))?;
        let view = staging.get_mapped_range(..).map_err(|e| lost(&e))?;
        Ok(view.to_vec())
    }
}

fn fastest_adapter() -> Result<Adapter, GpuError> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..Default::default()
    };
    pollster::block_on(instance.request_adapter(&options)).map_err(|e| GpuError::NoAdapter(e.to_string()))
}

#[cfg(test)]
mod tests;
