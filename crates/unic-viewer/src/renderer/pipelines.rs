//! Shaders and pipelines.

use super::layouts::Layouts;
use super::{DEPTH_FORMAT, LIGHT_FORMAT, SHOWN_FORMAT};
use unic_gpu::wgpu;

const VIEW: &str = include_str!("../shaders/view.wgsl");
const FLOOR: &str = include_str!("../shaders/floor.wgsl");
const SURFACE: &str = include_str!("../shaders/surface.wgsl");
const MARK: &str = include_str!("../shaders/mark.wgsl");
const TONE: &str = include_str!("../shaders/tone.wgsl");

/// Pipelines for a number of samples of a pixel.
#[derive(Debug)]
pub(crate) struct Pipelines {
    pub(crate) sky: wgpu::RenderPipeline,
    pub(crate) floor: wgpu::RenderPipeline,
    pub(crate) surface: wgpu::RenderPipeline,
    pub(crate) lines: wgpu::RenderPipeline,
    pub(crate) mark: wgpu::RenderPipeline,
    pub(crate) key_shadow: wgpu::RenderPipeline,
    pub(crate) above_shadow: wgpu::RenderPipeline,
    pub(crate) tone: wgpu::RenderPipeline,
}

/// A pipeline, as far as they differ.
struct Recipe<'a> {
    module: &'a wgpu::ShaderModule,
    layout: &'a wgpu::PipelineLayout,
    vertex: &'static str,
    fragment: &'static str,
    vertices: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    topology: wgpu::PrimitiveTopology,
    depth: Depth,
    target: Target,
}

/// Use of the depth buffer.
#[derive(Clone, Copy)]
enum Depth {
    None,
    /// Nearer or equal. A reversed depth of 0 is behind everything.
    Test {
        writes: bool,
    },
    /// A shadow map: smaller is nearer.
    Shadow,
}

/// Attachment that a pipeline draws to.
#[derive(Clone, Copy)]
enum Target {
    Depth,
    Light { samples: u32, blends: bool },
    Shown,
}

const CORNER: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Uint32, 1 => Float32x3];
const MARK_POINT: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x4];

impl Pipelines {
    pub(crate) fn new(device: &wgpu::Device, layouts: &Layouts, samples: u32) -> Self {
        let module = |label, parts: &[&str]| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(parts.concat().into()),
            })
        };
        let layout = |groups: &[&wgpu::BindGroupLayout]| {
            let groups: Vec<_> = groups.iter().copied().map(Some).collect();
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: &groups,
                immediate_size: 0,
            })
        };
        let floor_module = module("floor", &[VIEW, FLOOR]);
        let surface_module = module("surface", &[VIEW, SURFACE]);
        let mark_module = module("mark", &[VIEW, MARK]);
        let tone_module = module("tone", &[TONE]);
        let world = layout(&[&layouts.view]);
        let parts = layout(&[&layouts.view, &layouts.part]);
        let shadows = layout(&[&layouts.shadow, &layouts.part]);
        let tone = layout(&[&layouts.tone]);
        let corners = [Some(vertex_buffer(16, &CORNER))];
        let points = [Some(vertex_buffer(28, &MARK_POINT))];
        let light = |blends| Target::Light { samples, blends };
        let sky = Recipe {
            module: &floor_module,
            layout: &world,
            vertex: "sky_vertex",
            fragment: "sky_fragment",
            vertices: &[],
            topology: wgpu::PrimitiveTopology::TriangleList,
            depth: Depth::Test { writes: false },
            target: light(false),
        };
        let floor = Recipe {
            vertex: "floor_vertex",
            fragment: "floor_fragment",
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            depth: Depth::Test { writes: true },
            ..sky
        };
        let surface = Recipe {
            module: &surface_module,
            layout: &parts,
            vertex: "surface_vertex",
            fragment: "surface_fragment",
            vertices: &corners,
            depth: Depth::Test { writes: true },
            ..sky
        };
        let lines = Recipe {
            vertex: "line_vertex",
            fragment: "line_fragment",
            vertices: &[],
            topology: wgpu::PrimitiveTopology::LineList,
            depth: Depth::Test { writes: false },
            ..surface
        };
        let mark = Recipe {
            module: &mark_module,
            vertex: "mark_vertex",
            fragment: "mark_fragment",
            vertices: &points,
            depth: Depth::Test { writes: false },
            target: light(true),
            ..sky
        };
        let key_shadow = Recipe {
            layout: &shadows,
            vertex: "key_shadow_vertex",
            fragment: "shadow_fragment",
            depth: Depth::Shadow,
            target: Target::Depth,
            ..surface
        };
        let above_shadow = Recipe {
            vertex: "above_shadow_vertex",
            ..key_shadow
        };
        let tone = Recipe {
            module: &tone_module,
            layout: &tone,
            vertex: "tone_vertex",
            fragment: "tone_fragment",
            depth: Depth::None,
            target: Target::Shown,
            ..sky
        };
        Self {
            sky: sky.build(device),
            floor: floor.build(device),
            surface: surface.build(device),
            lines: lines.build(device),
            mark: mark.build(device),
            key_shadow: key_shadow.build(device),
            above_shadow: above_shadow.build(device),
            tone: tone.build(device),
        }
    }
}

fn vertex_buffer(stride: u64, attributes: &[wgpu::VertexAttribute]) -> wgpu::VertexBufferLayout<'_> {
    wgpu::VertexBufferLayout {
        array_stride: stride,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes,
    }
}

impl Recipe<'_> {
    fn build(&self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let targets = self.target.state().map(Some);
        let fragment = wgpu::FragmentState {
            module: self.module,
            entry_point: Some(self.fragment),
            compilation_options: Default::default(),
            targets: targets.as_slice(),
        };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.vertex),
            layout: Some(self.layout),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(self.vertex),
                compilation_options: Default::default(),
                buffers: self.vertices,
            },
            primitive: wgpu::PrimitiveState {
                topology: self.topology,
                ..Default::default()
            },
            depth_stencil: self.depth.state(),
            multisample: wgpu::MultisampleState {
                count: self.target.samples(),
                ..Default::default()
            },
            fragment: Some(fragment),
            multiview_mask: None,
            cache: None,
        })
    }
}

impl Depth {
    fn state(self) -> Option<wgpu::DepthStencilState> {
        use wgpu::CompareFunction as Compare;
        let (writes, compare, bias) = match self {
            Self::None => return None,
            Self::Test { writes } => (writes, Compare::GreaterEqual, Default::default()),
            Self::Shadow => {
                let bias = wgpu::DepthBiasState {
                    constant: 2,
                    slope_scale: 2.0,
                    clamp: 0.0,
                };
                (true, Compare::Less, bias)
            }
        };
        Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(writes),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias,
        })
    }
}

impl Target {
    fn state(self) -> Option<wgpu::ColorTargetState> {
        let (format, blend) = match self {
            Self::Depth => return None,
            Self::Light { blends, .. } => (
                LIGHT_FORMAT,
                blends.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            ),
            Self::Shown => (SHOWN_FORMAT, None),
        };
        Some(wgpu::ColorTargetState {
            format,
            blend,
            write_mask: wgpu::ColorWrites::ALL,
        })
    }

    fn samples(self) -> u32 {
        match self {
            Self::Light { samples, .. } => samples,
            Self::Depth | Self::Shown => 1,
        }
    }
}
