//! A walking character in the T-shirt that comes with `unic`.
//!
//! `cargo run --release --features window --example dressed`

use bevy::{mesh::skinning::SkinnedMeshInverseBindposes, prelude::*};
use bevy_unic::{UnicGarment, UnicModel, UnicPlugin, spawn_character};

/// Folder of the garments that come with the program.
const GARMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../apps/unic-cli/garments");

fn main() {
    let assets = AssetPlugin {
        file_path: GARMENTS.into(),
        ..default()
    };
    App::new()
        .add_plugins((DefaultPlugins.set(assets), UnicPlugin))
        .add_systems(Startup, scene)
        .add_systems(Update, (dress, remember, walk).chain())
        .run();
}

/// The model, until the character is there.
#[derive(Resource)]
struct Wardrobe(Handle<UnicModel>);

/// Joint of the character.
#[derive(Component)]
struct Joint;

/// Transform of a joint in the bind pose.
#[derive(Component)]
struct Bind(Transform);

fn scene(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let ground = Plane3d::default().mesh().size(20.0, 20.0);
    commands.spawn((
        Mesh3d(meshes.add(ground)),
        MeshMaterial3d(materials.add(Color::srgb(0.5, 0.5, 0.5))),
    ));
    commands.insert_resource(Wardrobe(assets.load("tshirt.unic")));
    let from = Transform::from_xyz(1.0, 1.4, 2.6).looking_at(Vec3::Y, Vec3::Y);
    commands.spawn((Camera3d::default(), from));
    let sun = DirectionalLight {
        shadow_maps_enabled: true,
        ..default()
    };
    commands.spawn((
        sun,
        Transform::from_xyz(2.0, 4.0, 3.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
}

/// Spawns the character and its garment when the model is loaded.
fn dress(
    mut commands: Commands,
    wardrobe: Option<Res<Wardrobe>>,
    models: Res<Assets<UnicModel>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut bind_poses: ResMut<Assets<SkinnedMeshInverseBindposes>>,
) {
    let Some(wardrobe) = wardrobe else { return };
    let Some(UnicModel(model)) = models.get(&wardrobe.0) else {
        return;
    };
    let (character, joints) = spawn_character(&mut commands, &mut meshes, &mut bind_poses, model);
    let skin = materials.add(Color::srgb(0.8, 0.6, 0.5));
    commands.entity(character).insert(MeshMaterial3d(skin));
    for joint in joints {
        commands.entity(joint).insert(Joint);
    }
    let cloth = StandardMaterial {
        base_color: Color::srgb(0.2, 0.4, 0.8),
        cull_mode: None,
        double_sided: true,
        ..default()
    };
    let cloth = MeshMaterial3d(materials.add(cloth));
    commands.spawn((UnicGarment::new(wardrobe.0.clone(), character), cloth));
    commands.remove_resource::<Wardrobe>();
}

/// Keeps the transforms that the joints are spawned with.
fn remember(mut commands: Commands, joints: Query<(Entity, &Transform), Added<Joint>>) {
    for (joint, transform) in &joints {
        commands.entity(joint).insert(Bind(*transform));
    }
}

/// Swings the limbs, on the spot.
fn walk(time: Res<Time>, mut joints: Query<(&Name, &Bind, &mut Transform)>) {
    let t = time.elapsed_secs();
    for (name, Bind(bind), mut transform) in &mut joints {
        let swing = 0.4 * (5.0 * t).sin();
        let turn = match name.as_str() {
            "L_hip" => Quat::from_rotation_x(swing),
            "R_hip" => Quat::from_rotation_x(-swing),
            // The arms of the bind pose are spread.
            "L_shoulder" => Quat::from_rotation_x(-swing) * Quat::from_rotation_z(-1.1),
            "R_shoulder" => Quat::from_rotation_x(swing) * Quat::from_rotation_z(1.1),
            "spine1" => Quat::from_rotation_y(0.3 * (5.0 * t).cos()),
            _ => continue,
        };
        *transform = bind.with_rotation(turn * bind.rotation);
    }
}
