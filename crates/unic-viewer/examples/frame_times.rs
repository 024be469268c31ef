//! Times of a play on this machine: motion matching, garment and drawing apart, for the T-shirt that
//! comes with the program and finer meshes of it.
//!
//! ```text
//! cargo run --release -p unic-viewer --example frame_times
//! ```

use glam::Vec2;
use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use unic_builtin::motion::control_set;
use unic_core::{
    Model,
    motion_matching::{Command, ControllerSettings, Database, DatabaseSettings, TagFilter, TaggedClip},
    subdivide::subdivided,
};
use unic_io::{joint_names::counterparts, retarget::legs_of};
use unic_viewer::{
    AdapterKind, Canvas, Costume, FollowCamera, GpuContext, Material, Outfit, PlaySession, PlaySettings,
    Quality, Renderer, Settling, Steering,
};

/// Size of the pictures, pixels.
const SIZE: [u32; 2] = [1120, 700];
/// Seconds that are played for each row.
const SECONDS: f32 = 2.0;
/// Pictures a second.
const FPS: f32 = 30.0;

fn main() -> Result<(), Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../apps/unic-cli/garments/tshirt.unic");
    let mut model = Arc::new(Model::from_bytes(&std::fs::read(path)?)?);
    let database = database(&model)?;
    let context = GpuContext::new()?;
    let is_hardware = AdapterKind::of(&context) == AdapterKind::Hardware;
    println!(
        "{}, pictures of {} x {}",
        context.adapter_name(),
        SIZE[0],
        SIZE[1]
    );
    println!("vertices  characters  garments on  motion ms  garment ms  draw ms by quality, best first");
    for level in 0..3 {
        if level > 0 {
            model = Arc::new(model.with_mesh(subdivided(&model.garment().rest).mesh)?);
        }
        let devices: &[Option<&GpuContext>] = match is_hardware {
            true => &[None, Some(&context)],
            false => &[None],
        };
        for &device in devices {
            for characters in if level == 0 { &[1, 16][..] } else { &[1][..] } {
                row(&model, &database, &context, device, *characters)?;
            }
        }
    }
    Ok(())
}

fn database(model: &Model) -> Result<Arc<Database>, Box<dyn Error>> {
    let character = model.character();
    let clips = control_set(character, 0, model.config().fps)?;
    let legs = legs_of(&character.skeleton).ok_or("expected two legs")?;
    let settings = DatabaseSettings {
        mirror: counterparts(character.skeleton.names()),
        ..DatabaseSettings::standard(character, legs)
    };
    let clips: Vec<TaggedClip> = clips.iter().map(TaggedClip::untagged).collect();
    Ok(Arc::new(Database::build(&character.skeleton, &clips, settings)?))
}

fn row(
    model: &Arc<Model>,
    database: &Arc<Database>,
    context: &GpuContext,
    device: Option<&GpuContext>,
    characters: usize,
) -> Result<(), Box<dyn Error>> {
    let outfit = Outfit::new("shirt".into(), Arc::clone(model), Material::SHIRT, device)?;
    let costume = Costume {
        outfit: Arc::new(outfit),
        database: Arc::clone(database),
        tags: TagFilter::default(),
    };
    let mut session = PlaySession::new(PlaySettings {
        costumes: vec![costume],
        characters,
        control: ControllerSettings::new(0.5),
        skin: Material::SKIN,
        settling: Settling::AtOnce,
    })?;
    let (mut motion_s, mut garment_s, mut draw_ms) = (0.0, 0.0, Vec::new());
    let frames = (SECONDS * FPS) as usize;
    for quality in Quality::STEPS {
        let mut renderer = Renderer::new(context.clone());
        let mut canvas = Canvas::new(context, SIZE, quality)?;
        let camera = FollowCamera::new(session.centre(), characters).orbit.camera()?;
        let mut draw = |session: &PlaySession| -> Result<f64, Box<dyn Error>> {
            let start = Instant::now();
            session.with_scene(|scene| renderer.draw(scene, &camera, &mut canvas))?;
            context.wait()?;
            Ok(start.elapsed().as_secs_f64())
        };
        // The first picture compiles shaders.
        draw(&session)?;
        let mut times = Vec::new();
        for _ in 0..frames {
            let command = Command::travel(Vec2::new(0.4, 1.2));
            session.advance(1.0 / FPS, Steering::Command(command))?;
            motion_s += session.times().motion_s;
            garment_s += session.times().garment_s;
            times.push(draw(&session)?);
        }
        times.sort_by(f64::total_cmp);
        draw_ms.push(format!("{:.1}", times[times.len() / 2] * 1e3));
    }
    let by_tick = 1e3 / (Quality::STEPS.len() * frames) as f32;
    println!(
        "{:8}  {characters:10}  {:11}  {:9.2}  {:10.1}  {}",
        model.vertex_count(),
        if device.is_some() { "adapter" } else { "processor" },
        motion_s * by_tick,
        garment_s * by_tick,
        draw_ms.join("  ")
    );
    Ok(())
}
