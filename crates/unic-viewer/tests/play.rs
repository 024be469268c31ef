//! Contract of a play without a window: ticks at the garment's rate for every display, the same
//! bytes on every run and number of threads, crowds, and costumes.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

use glam::{Vec2, Vec3};
use std::path::Path;
use std::sync::Arc;
use unic_builtin::motion::control_set;
use unic_core::Model;
use unic_core::motion_matching::{
    Command, ControllerSettings, Database, DatabaseSettings, MouseButtons, TagFilter, TaggedClip,
};
use unic_io::{joint_names::counterparts, retarget::legs_of};
use unic_viewer::{
    Canvas, Costume, Fabric, GpuContext, Material, Orbit, Outfit, PlaySession, PlaySettings, Quality,
    Renderer, Settling, Shape, Steering, Vertex, ViewerError,
};

/// Garments that come with the program.
const GARMENTS: &str = "../../apps/unic-cli/garments";

fn costumes() -> Vec<Costume> {
    let read = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(GARMENTS).join(name);
        Arc::new(Model::from_bytes(&std::fs::read(path).unwrap()).unwrap())
    };
    let models = ["tshirt.unic", "skirt.unic"].map(read);
    let character = models[0].character();
    let clips = control_set(character, 0, models[0].config().fps).unwrap();
    let settings = DatabaseSettings {
        mirror: counterparts(character.skeleton.names()),
        ..DatabaseSettings::standard(character, legs_of(&character.skeleton).unwrap())
    };
    let clips: Vec<TaggedClip> = clips.iter().map(TaggedClip::untagged).collect();
    let database = Arc::new(Database::build(&character.skeleton, &clips, settings).unwrap());
    let cloth = Material::cloth(Fabric::Linen, [0.5; 3]);
    let outfit = |model| Arc::new(Outfit::new("garment".into(), model, cloth, None).unwrap());
    models
        .map(|model| Costume {
            outfit: outfit(model),
            database: Arc::clone(&database),
            tags: TagFilter::default(),
        })
        .into()
}

fn session(costumes: &[Costume], characters: usize) -> PlaySession {
    PlaySession::new(PlaySettings {
        costumes: costumes.to_vec(),
        characters,
        control: ControllerSettings::new(0.5),
        skin: Material::SKIN,
        settling: Settling::AtOnce,
    })
    .unwrap()
}

fn walk(session: &mut PlaySession, seconds: f32, frames: usize) {
    for _ in 0..frames {
        let steering = Steering::Command(Command::travel(Vec2::new(0.5, 1.2)));
        session.advance(seconds, steering).unwrap();
    }
}

fn shown(session: &PlaySession) -> Vec<Vertex> {
    let parts = session.parts();
    let vertices = parts.iter().flat_map(|part| match part.shape {
        Shape::Host(vertices) => vertices,
        Shape::Device { .. } => panic!("a shape on a device"),
    });
    vertices.copied().collect()
}

#[test]
fn displays_of_all_rates_show_the_same_play() {
    let costumes = costumes();
    let mut slow = session(&costumes, 1);
    let mut fast = session(&costumes, 1);
    // Binary fractions of a second, so that both add up to the same time.
    walk(&mut slow, 0.125, 16);
    walk(&mut fast, 0.0078125, 256);
    assert_eq!(slow.seconds(), fast.seconds());
    assert_eq!(slow.root(), fast.root());
    assert!(slow.root().position.length() > 1.0, "{:?}", slow.root());
    assert_eq!(shown(&slow), shown(&fast));
    // Between two ticks the picture moves.
    let before = shown(&fast);
    walk(&mut fast, 0.002, 1);
    assert_eq!(slow.seconds(), fast.seconds());
    assert_ne!(shown(&fast), before);
}

#[test]
fn a_crowd_follows_with_the_same_bytes_for_any_number_of_threads() {
    let costumes = costumes();
    let play = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut session = session(&costumes, 4);
            walk(&mut session, 1.0 / 30.0, 60);
            (shown(&session), session.parts().len(), session.root())
        })
    };
    let (vertices, parts, root) = play(1);
    assert_eq!(parts, 8);
    assert_eq!(play(3).0, vertices);
    // The last character is near its place, a metre and a half behind the first one.
    let body = costumes[0].outfit.model().character().body.vertices.len();
    let last = &vertices[vertices.len() - costumes[0].outfit.model().vertex_count() - body..][..body];
    let middle = last.iter().map(|v| v.position).sum::<Vec3>() / body as f32;
    let way = Vec2::new(middle.x, middle.z) - root.position;
    assert!((1.0..3.5).contains(&way.length()), "{way}");
}

#[test]
fn costumes_change_where_the_character_stands_and_garments_restart() {
    let costumes = costumes();
    let mut session = session(&costumes, 1);
    walk(&mut session, 1.0 / 30.0, 45);
    let place = session.root().position;
    session.wear(1).unwrap();
    assert_eq!(session.costume_index(), 1);
    assert!(session.root().position.distance(place) < 1e-3);
    session.set_wind(Vec3::X * 4.0);
    walk(&mut session, 1.0 / 30.0, 10);
    let before = shown(&session);
    session.restart_garments().unwrap();
    let after = shown(&session);
    assert_ne!(before, after, "the garment starts from its mean shape");
    assert!(after.iter().all(|v| v.position.is_finite()));
    session.wear(2).unwrap();
    assert_eq!(
        session.costume_index(),
        0,
        "after the last costume comes the first"
    );
}

#[test]
fn a_walk_goes_on_in_another_costume_and_in_company() {
    let costumes = costumes();
    let [mut alone, mut changing] = [session(&costumes, 1), session(&costumes, 1)];
    walk(&mut alone, 1.0 / 50.0, 120);
    walk(&mut changing, 1.0 / 50.0, 60);
    changing.wear(1).unwrap();
    walk(&mut changing, 1.0 / 50.0, 20);
    changing.set_characters(4).unwrap();
    walk(&mut changing, 1.0 / 50.0, 20);
    assert_eq!(changing.characters(), 4);
    let garment = shown(&changing);
    changing.set_characters(1).unwrap();
    let [body, cloth] = [
        &costumes[1].outfit.model().character().body.vertices.len(),
        &costumes[1].outfit.model().vertex_count(),
    ];
    assert_eq!(
        shown(&changing),
        garment[..body + cloth],
        "the first garment goes on"
    );
    walk(&mut changing, 1.0 / 50.0, 20);
    assert_eq!(changing.root(), alone.root());
    assert!(alone.root().position.length() > 2.0);
}

#[test]
fn the_mouse_steers_to_the_pointer_and_its_target_is_marked() {
    let costumes = costumes();
    let mut session = session(&costumes, 1);
    let pointer = Vec2::new(-2.0, 1.0);
    assert_eq!(session.marks().len(), 2, "path and object");
    for _ in 0..240 {
        let buttons = MouseButtons::Left;
        session
            .advance(1.0 / 60.0, Steering::Mouse { pointer, buttons })
            .unwrap();
    }
    assert_eq!(session.marks().len(), 3, "and the target of the mouse");
    assert!(
        session.root().position.distance(pointer) < 0.5,
        "{:?}",
        session.root()
    );
}

#[test]
fn garments_on_a_device_are_drawn_as_those_on_the_processor() {
    let context = match GpuContext::new() {
        Ok(context) => context,
        Err(why) => return eprintln!("skipped: no adapter that draws ({why})"),
    };
    let host = costumes().remove(0);
    let model = Arc::clone(host.outfit.model());
    let cloth = Material::cloth(Fabric::Plain, [0.8, 0.2, 0.2]);
    let outfit = |device| Arc::new(Outfit::new("shirt".into(), Arc::clone(&model), cloth, device).unwrap());
    let pictures = [outfit(None), outfit(Some(&context))].map(|outfit| {
        let costume = Costume {
            outfit,
            ..host.clone()
        };
        let mut session = session(&[costume], 1);
        // Two ticks and a half: both buffers are drawn.
        walk(&mut session, 2.5 / 30.0, 1);
        let mut renderer = Renderer::new(context.clone());
        let mut canvas = Canvas::new(&context, [120, 160], Quality::BEST).unwrap();
        let camera = Orbit::person(Vec3::Y).camera().unwrap();
        let drawn = session.with_scene(|scene| renderer.draw(scene, &camera, &mut canvas));
        drawn.unwrap();
        canvas.read(&context).unwrap()
    });
    let [host, device] = &pictures;
    let pairs = host.pixels().iter().zip(device.pixels());
    let red = host.pixels().iter().filter(|p| p[0] > 2 * p[1]).count();
    assert!(red > 500, "the shirt is in view: {red}");
    // Positions differ by rounding, and so do a few pixels of edges.
    let off = pairs
        .filter(|(a, b)| (0..3).any(|i| a[i].abs_diff(b[i]) > 16))
        .count();
    assert!(off < 40, "{off} pixels differ");
}

#[test]
fn plays_without_costumes_or_at_other_rates_are_refused() {
    let settings = |costumes| PlaySettings {
        skin: Material::SKIN,
        costumes,
        characters: 1,
        control: ControllerSettings::new(0.5),
        settling: Settling::AtOnce,
    };
    let refused = PlaySession::new(settings(Vec::new()));
    assert!(matches!(refused, Err(ViewerError::NoCostume)));
    let mut costume = costumes().remove(0);
    let model = costume.outfit.model();
    let character = model.character();
    let fps = 2.0 * model.config().fps;
    let clips = control_set(character, 0, fps).unwrap();
    let clips: Vec<TaggedClip> = clips.iter().map(TaggedClip::untagged).collect();
    let settings_of = DatabaseSettings::standard(character, legs_of(&character.skeleton).unwrap());
    costume.database = Arc::new(Database::build(&character.skeleton, &clips, settings_of).unwrap());
    let refused = PlaySession::new(settings(vec![costume]));
    assert!(matches!(refused, Err(ViewerError::Rate { .. })));
}
