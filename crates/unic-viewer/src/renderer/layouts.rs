//! Layouts of bind groups.

use unic_gpu::wgpu;

/// Layouts of bind groups.
#[derive(Debug)]
pub(crate) struct Layouts {
    /// View, shadow maps and their sampler.
    pub(crate) view: wgpu::BindGroupLayout,
    /// View alone, for passes that write the shadow maps.
    pub(crate) shadow: wgpu::BindGroupLayout,
    /// One part.
    pub(crate) part: wgpu::BindGroupLayout,
    /// Light and its sampler.
    pub(crate) tone: wgpu::BindGroupLayout,
}

impl Layouts {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        use wgpu::ShaderStages as Stages;
        let both = Stages::VERTEX | Stages::FRAGMENT;
        let depth = texture(wgpu::TextureSampleType::Depth);
        let light = texture(wgpu::TextureSampleType::Float { filterable: true });
        let comparing = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let filtering = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let uniform = buffer(wgpu::BufferBindingType::Uniform);
        let storage = buffer(wgpu::BufferBindingType::Storage { read_only: true });
        let view = [
            (both, uniform),
            (Stages::FRAGMENT, depth),
            (Stages::FRAGMENT, depth),
            (Stages::FRAGMENT, comparing),
        ];
        let vertex = (Stages::VERTEX, storage);
        Self {
            view: layout(device, "view", &view),
            shadow: layout(device, "shadow", &view[..1]),
            part: layout(device, "part", &[(both, uniform), vertex, vertex, vertex]),
            tone: layout(
                device,
                "tone",
                &[(Stages::FRAGMENT, light), (Stages::FRAGMENT, filtering)],
            ),
        }
    }
}

fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

fn texture(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

fn layout(
    device: &wgpu::Device,
    label: &str,
    bindings: &[(wgpu::ShaderStages, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entry = |(binding, &(visibility, ty))| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip(bindings).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}
