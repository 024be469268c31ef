//! Device context: creation, buffers, downloads and error scopes.

use crate::{GpuError, Precision};
use half::f16;
use wgpu::{
    Adapter, Buffer, BufferUsages, CooperativeScalarType, Device, ExperimentalFeatures, Features, Queue,
    util::DeviceExt,
};

/// Device with its queue. Clones are cheap and refer to the same device.
#[derive(Clone, Debug)]
pub struct GpuContext {
    device: Device,
    queue: Queue,
    matrix_units: Option<MatrixUnits>,
}

/// Matrix units of a device: they multiply matrices of f16 and sum in f32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MatrixUnits {
    /// Number of rows, and of columns, of each matrix.
    pub(crate) side: usize,
    /// Largest number of invocations in a subgroup, which holds a matrix together.
    pub(crate) largest_subgroup: usize,
}

impl MatrixUnits {
    const FEATURES: Features = Features::EXPERIMENTAL_COOPERATIVE_MATRIX
        .union(Features::SUBGROUP)
        .union(Features::SHADER_F16);

    /// Finds the largest square matrices of an adapter.
    fn of_adapter(adapter: &Adapter) -> Option<Self> {
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
    /// Features that kernels and timings use if an adapter has them. A caller who brings a device
    /// requests the wanted ones.
    pub const USEFUL_FEATURES: Features = Features::SHADER_F16.union(Features::TIMESTAMP_QUERY);

    /// Opens the fastest adapter of this machine. The environment variable `WGPU_BACKEND` narrows
    /// the choice.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] without an adapter, [`GpuError::Device`] when it gives no device.
    pub fn new() -> Result<Self, GpuError> {
        let adapter = fastest_adapter()?;
        Self::open(&adapter, None)
    }

    /// Opens the fastest adapter with its matrix units, if it has any, for
    /// [`Precision::F16Matrix`].
    ///
    /// They are an experimental feature of wgpu, whose bugs could be undefined behaviour that no
    /// caller can prevent. So they are used only on request. Where subgroups of a device differ in
    /// size, a workgroup has as many invocations as it needs with the largest, and some idle.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] without an adapter, [`GpuError::Device`] when it gives no device.
    pub fn with_matrix_units() -> Result<Self, GpuError> {
        let adapter = fastest_adapter()?;
        Self::open(&adapter, MatrixUnits::of_adapter(&adapter))
    }

    fn open(adapter: &Adapter, matrix_units: Option<MatrixUnits>) -> Result<Self, GpuError> {
        let (features, experimental_features) = match matrix_units {
            None => (Features::empty(), ExperimentalFeatures::disabled()),
            // SAFETY: the caller asked for an experimental feature of wgpu. The kernels load and
            // store whole matrices within their buffers. The driver and wgpu ensure the rest: that
            // subgroups are full, that a workgroup has as many as it holds, and that they see each
            // other's memory after a barrier.
            Some(_) => (MatrixUnits::FEATURES, unsafe { ExperimentalFeatures::enabled() }),
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("unic"),
            required_features: adapter.features() & Self::USEFUL_FEATURES | features,
            // All that the adapter has: more workgroup memory allows larger tiles and wider fields.
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

    /// Uses the caller's own device and queue, so that a renderer can draw the results in place.
    /// Matrix units are not used.
    pub fn from_device(device: Device, queue: Queue) -> Self {
        Self {
            device,
            queue,
            matrix_units: None,
        }
    }

    /// Returns whether matrix units are in use, for [`Precision::F16Matrix`].
    pub fn has_matrix_units(&self) -> bool {
        self.matrix_units.is_some()
    }

    /// Matrix units, or an error without any.
    pub(crate) fn needed_matrix_units(&self) -> Result<MatrixUnits, GpuError> {
        self.matrix_units.ok_or(GpuError::Feature {
            what: "a field on matrix units",
            feature: "EXPERIMENTAL_COOPERATIVE_MATRIX",
        })
    }

    /// Device of the context.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Queue of the device. Work that is submitted to it after a step sees the step's garment.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// Name of the adapter and its driver.
    pub fn adapter_name(&self) -> String {
        let info = self.device.adapter_info();
        format!("{} ({} {})", info.name, info.driver, info.driver_info)
    }

    /// Returns whether the device has all of these features.
    pub fn has(&self, features: Features) -> bool {
        self.device.features().contains(features)
    }

    /// Blocks until all submitted work is done.
    ///
    /// # Errors
    /// Fails when the device is lost.
    pub fn wait(&self) -> Result<(), GpuError> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        polled.map(|_| ()).map_err(|e| GpuError::Device(e.to_string()))
    }

    /// Runs `make`, which creates objects on the device, and returns the device's error instead of
    /// a panic.
    pub(crate) fn checked<T>(&self, make: impl FnOnce() -> Result<T, GpuError>) -> Result<T, GpuError> {
        let scopes = [
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Internal,
            wgpu::ErrorFilter::Validation,
        ]
        .map(|filter| self.device.push_error_scope(filter));
        let made = make();
        // All scopes must be popped, the last one first, even after an error.
        let errors = scopes
            .into_iter()
            .rev()
            .map(|scope| pollster::block_on(scope.pop()));
        match errors.fold(None, Option::or) {
            Some(error) => Err(GpuError::Device(error.to_string())),
            None => made,
        }
    }

    /// Creates a storage buffer with `contents`, which may be empty.
    pub(crate) fn upload<T: bytemuck::NoUninit>(&self, label: &str, contents: &[T]) -> Buffer {
        self.filled(label, contents, BufferUsages::STORAGE | BufferUsages::COPY_DST)
    }

    /// Creates a storage buffer of weights, in f16 where the precision has it.
    pub(crate) fn upload_weights(&self, label: &str, precision: Precision, weights: &[f32]) -> Buffer {
        match precision {
            Precision::F32 => self.upload(label, weights),
            Precision::F16 | Precision::F16Matrix => {
                let halves: Vec<u16> = weights.iter().map(|&w| f16::from_f32(w).to_bits()).collect();
                self.upload(label, &halves)
            }
        }
    }

    /// Creates a uniform buffer.
    pub(crate) fn uniform<T: bytemuck::NoUninit>(&self, label: &str, contents: &T) -> Buffer {
        self.filled(label, std::slice::from_ref(contents), BufferUsages::UNIFORM)
    }

    fn filled<T: bytemuck::NoUninit>(&self, label: &str, contents: &[T], usage: BufferUsages) -> Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        // A binding may not be smaller than one element of its array, which may be four numbers
        // where `T` is one.
        let nothing = vec![0; size_of::<T>().next_multiple_of(4).max(32)];
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: if bytes.is_empty() { &nothing } else { bytes },
            usage,
        })
    }

    /// Creates a storage buffer of zeros.
    pub(crate) fn zeroed(&self, label: &str, bytes: usize, usage: BufferUsages) -> Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.max(32).next_multiple_of(4) as u64,
            usage: usage | BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    }

    /// Blocks until the device is done and copies `bytes` bytes of a buffer, from byte `from` on.
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
        // Storage buffers cannot be mapped, so the bytes pass through a staging buffer.
        encoder.copy_buffer_to_buffer(buffer, from, &staging, 0, bytes);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |result| {
            // Sending fails only without a receiver, which lives until it has the result.
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
