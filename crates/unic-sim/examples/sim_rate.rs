//! Prints the time per frame of the built-in garments on the built-in human while walking, for one
//! and two threads, with and without self-contact.
//!
//! ```text
//! cargo run --release -p unic-sim --example sim_rate -- [FRAMES [GARMENT...]]
//! ```

use glam::Vec3;
use std::{sync::Arc, time::Instant};
use unic_builtin::{
    garments::{Fabric, GarmentError, GarmentMesh, PleatedDress, Robe, TShirt, TulleSkirt},
    human::human,
    motion::standard_set,
};
use unic_core::{Pose, character::Character, surface::Surface};
use unic_sim::{
    Attachment, Cloth, ClothSpec, Material, SettleSettings, Simulation, SimulationSettings,
    self_contact::SelfContactSettings,
};

type Failure = Box<dyn std::error::Error>;
type Maker = fn(&Character) -> Result<GarmentMesh, GarmentError>;

const GARMENTS: [(&str, Maker); 4] = [
    ("tshirt", |c| TShirt::default().make(c)),
    ("pleated_dress", |c| PleatedDress::default().make(c)),
    ("tulle_skirt", |c| TulleSkirt::default().make(c)),
    ("robe", |c| Robe::default().make(c)),
];

/// Settling that is just long enough for the garment to lie on the body. It does not have to be at
/// rest for this measurement.
const SETTLE: SettleSettings = SettleSettings {
    hold_s: 0.3,
    move_s: 0.5,
    rest_s: 0.0,
    start_s: 0.1,
    damping_per_s: 5.0,
};

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let frames = arguments.next().map_or(Ok(20), |n| n.parse())?;
    let named: Vec<String> = arguments.collect();
    let character = Arc::new(human(&Default::default())?);
    let clip = &standard_set(&character, 1, 30.0)?.train[1];
    println!(
        "on {} of {} body vertices",
        clip.name,
        character.body.vertices.len()
    );
    println!("garment        vertices  build ms  self  threads   wall ms    cpu ms  a frame");
    let is_wanted = |name: &str| named.is_empty() || named.iter().any(|n| n == name);
    for (name, make) in GARMENTS.iter().filter(|(name, _)| is_wanted(name)) {
        let spec = spec(&make(&character)?, &character);
        let start = Instant::now();
        let cloth = Arc::new(Cloth::new(&spec)?);
        let build_ms = 1e3 * start.elapsed().as_secs_f64();
        for self_contact in [false, true] {
            let settled = settled(&cloth, &character, &clip.poses, self_contact)?;
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
                let poses = &clip.poses[1..=frames];
                let FrameTime { wall_ms, cpu_ms } = pool.install(|| frame_time(settled.clone(), poses))?;
                let vertices = cloth.vertex_count();
                let on = if self_contact { "on" } else { "off" };
                println!(
                    "{name:<13}  {vertices:>8}  {build_ms:>8.0}  {on:>4}  {threads:>7}  {wall_ms:>8.1}  \
                     {cpu_ms:>8.1}"
                );
            }
        }
    }
    Ok(())
}

/// Describes a built-in garment: attached vertices follow the body, and each part has its own
/// fabric.
fn spec(made: &GarmentMesh, character: &Character) -> ClothSpec {
    let body = &character.body;
    let surface = Surface::build(body);
    let held = (0..).zip(made.attached()).filter(|(_, is_held)| *is_held);
    let attachments = held.filter_map(|(vertex, _)| {
        Attachment::to_nearest(vertex, made.mesh.vertices[vertex as usize], body, &surface)
    });
    let part_of = |face: &[u32; 3]| made.part_of_vertex[face[0] as usize] as u16;
    ClothSpec {
        materials: made.parts.iter().map(|part| material(part.fabric)).collect(),
        face_materials: made.mesh.faces.iter().map(part_of).collect(),
        attachments: attachments.collect(),
        ..ClothSpec::new(made.mesh.clone(), Material::COTTON)
    }
}

fn material(fabric: Fabric) -> Material {
    match fabric {
        Fabric::Cotton => Material::COTTON,
        Fabric::Denim => Material::DENIM,
        Fabric::Silk => Material::SILK,
        Fabric::Tulle => Material::TULLE,
    }
}

/// A simulation that has settled in the first of the poses.
fn settled(
    cloth: &Arc<Cloth>,
    character: &Arc<Character>,
    poses: &[Pose],
    self_contact: bool,
) -> Result<Simulation, Failure> {
    let settings = SimulationSettings {
        self_contact: self_contact.then(|| SelfContactSettings {
            thickness_m: cloth.material().thickness,
            ..Default::default()
        }),
        settle: SETTLE,
        ..Default::default()
    };
    let mut simulation = Simulation::on_character(Arc::clone(cloth), Arc::clone(character), settings)?;
    simulation.settle(&poses[0], &poses[1])?;
    Ok(simulation)
}

/// Mean time of a frame.
struct FrameTime {
    wall_ms: f64,
    cpu_ms: f64,
}

fn frame_time(mut simulation: Simulation, poses: &[Pose]) -> Result<FrameTime, unic_sim::SimulationError> {
    let (start, cpu) = (Instant::now(), cpu_seconds());
    for pose in poses {
        simulation.step_frame(pose, Vec3::ZERO)?;
    }
    let ms_per_frame = 1e3 / poses.len() as f64;
    Ok(FrameTime {
        wall_ms: start.elapsed().as_secs_f64() * ms_per_frame,
        cpu_ms: (cpu_seconds() - cpu) * ms_per_frame,
    })
}

/// Returns the CPU time of the process in seconds, in ticks of 10 ms; zero on systems without
/// `/proc`.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the process may contain spaces, but it ends at the last parenthesis. User and
    // system time are the 12th and 13th field after it.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks = fields.skip(11).take(2).filter_map(|n| n.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}
