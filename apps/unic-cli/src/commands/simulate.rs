//! `unic simulate`.

mod folder;
mod inputs;
mod report;
mod work;

use crate::{
    args::{SimulateArgs, Switch},
    output::say,
};
use anyhow::{Result, anyhow};
use folder::Found;
use inputs::{Cut, Job};
use report::Summary;
use std::{sync::Arc, time::Instant};
use unic_core::{character::Character, surface::Surface};
use unic_io::{CaptureWriter, Manifest, counted};
use unic_sim::{
    Attachment, Cloth, ClothSpec, Material, SimulationSettings,
    contact::{ContactSettings, Friction},
    self_contact::SelfContactSettings,
};
use work::{Kept, Row, Workshop};

/// Pictures of a clip.
const SHOTS: usize = 8;
/// Held vertices give by this much for each newton, m/N: elastic in a waistband.
const ATTACHMENT_COMPLIANCE: f32 = 1e-3;

/// Simulates every motion and writes a capture.
pub(crate) fn run(args: &SimulateArgs) -> Result<()> {
    let started = Instant::now();
    folder::refuse(args)?;
    let character = inputs::character(args)?;
    args.force
        .settle(&args.character, &unic_io::check::character(&character))?;
    let cut = inputs::garment(args, &character)?;
    args.force.settle(
        &args.garment,
        &unic_io::check::garment(&cut.garment.rest, &character),
    )?;
    let jobs = inputs::jobs(args, &character)?;
    let settings = settings(args, &cut);
    report::open(args, &jobs)?;
    let record = folder::record(args, &cut, &jobs, &settings);
    let cloth = cloth(&cut, &character).map_err(|e| anyhow!("{}: {e}", args.garment.display()))?;
    let (_lock, found) = folder::open(args, &record)?;
    let vertices = cut.garment.rest.vertices.len();
    if found == Found::Finished {
        return tell_again(args, vertices, &jobs, started);
    }
    let mut writer = begin(args, &record, found, &character, &cut)?;
    let (left, kept) = match found {
        Found::Unfinished => keep_finished(args, &mut writer, &jobs)?,
        _ => (jobs.iter().collect(), Kept::default()),
    };
    announce(&cut, &jobs, &kept);
    let workshop = Workshop {
        character: Arc::new(character),
        cut: &cut,
        cloth: Arc::new(cloth),
        settings,
        shots: args.pictures.as_ref().map_or(0, |_| SHOTS),
    };
    let keep = |rows: &[Row]| report::keep(&Summary::new(args, vertices, rows, started.elapsed()));
    let mut rows = kept.rows.clone();
    let made = workshop.make(&left, kept, &mut writer, &keep)?;
    rows.extend(made.iter().map(|made| made.row.clone()));
    let summary = Summary::new(args, vertices, &rows, started.elapsed()).sorted(&jobs);
    report::keep(&summary)?;
    // Last: with `capture.toml` everything is there.
    writer.order_clips(jobs.iter().map(|job| job.clip.name.as_str()));
    writer.finish()?;
    folder::close(&args.out)?;
    report::draw(args, &workshop, &made)?;
    report::show(args, &summary)
}

/// A simulation that is finished already and asked for again, as after a crash in its last moment.
fn tell_again(args: &SimulateArgs, vertices: usize, jobs: &[Job], started: Instant) -> Result<()> {
    folder::close(&args.out)?;
    let rows = report::rows(&args.out);
    say(&format!("{} is finished already", args.out.display()));
    report::show(
        args,
        &Summary::new(args, vertices, &rows, started.elapsed()).sorted(jobs),
    )
}

/// From here on there is something to resume; a simulation that cannot begin leaves nothing.
fn begin(
    args: &SimulateArgs,
    record: &toml::Table,
    found: Found,
    character: &Character,
    cut: &Cut,
) -> Result<CaptureWriter> {
    if found == Found::Unfinished {
        folder::check_same_inputs(&args.out, character, cut)?;
    }
    let manifest = manifest(args, record);
    let writer = folder::begin(&args.out, record).and_then(|()| {
        let (garment, attributes) = (&cut.garment, &cut.attributes);
        let writer = CaptureWriter::create(&args.out, manifest, character, garment, attributes);
        Ok(writer?)
    });
    if writer.is_err() && found == Found::Nothing {
        folder::clear(&args.out)?;
    }
    writer
}

fn settings(args: &SimulateArgs, cut: &Cut) -> SimulationSettings {
    let default = SimulationSettings::default();
    // What most of the garment is made of touches the body.
    let material = most_common(&cut.materials);
    SimulationSettings {
        fps: args.fps,
        substeps_per_interval: args.substeps.map_or(default.substeps_per_interval, |n| {
            n.div_ceil(default.intervals_per_frame)
        }),
        contact: Some(ContactSettings {
            thickness_m: args.thickness.map_or(material.thickness, |mm| mm / 1000.0),
            body_friction: Friction {
                r#static: material.static_friction,
                dynamic: material.sliding_friction,
            },
            ..ContactSettings::default()
        }),
        self_contact: (args.self_collision == Switch::On).then(|| SelfContactSettings {
            thickness_m: material.thickness,
            ..SelfContactSettings::default()
        }),
        ..default
    }
}

fn most_common(materials: &[Material]) -> Material {
    let count = |material: &Material| materials.iter().filter(|m| *m == material).count();
    let distinct = distinct(materials);
    let most = distinct.into_iter().max_by_key(|material| count(material));
    most.unwrap_or(Material::COTTON)
}

fn distinct(materials: &[Material]) -> Vec<Material> {
    let mut distinct: Vec<Material> = Vec::new();
    for material in materials {
        if !distinct.contains(material) {
            distinct.push(*material);
        }
    }
    distinct
}

/// The garment as the solver wants it: pinned vertices follow the body where they touch it at rest.
fn cloth(cut: &Cut, character: &Character) -> Result<Cloth, unic_sim::ClothError> {
    let materials = distinct(&cut.materials);
    let index = |material: &Material| materials.iter().position(|m| m == material).unwrap_or(0) as u16;
    let face_materials = cut.materials.iter().map(index).collect();
    let surface = Surface::build(&character.body);
    let pinned = cut.attributes.pinned.iter().flatten().enumerate();
    let held = pinned.filter(|(_, pinned)| **pinned).map(|(v, _)| v);
    let attachments = held.filter_map(|v| {
        let place = cut.garment.rest.vertices[v];
        let attachment = Attachment::to_nearest(v as u32, place, &character.body, &surface)?;
        Some(Attachment {
            compliance: ATTACHMENT_COMPLIANCE,
            ..attachment
        })
    });
    Cloth::new(&ClothSpec {
        rest: cut.garment.rest.clone(),
        attachments: attachments.collect(),
        rest_angle_share: 1.0,
        pins: Vec::new(),
        materials,
        face_materials,
    })
}

fn manifest(args: &SimulateArgs, record: &toml::Table) -> Manifest {
    let name = args.out.file_name().unwrap_or_default().to_string_lossy();
    let mut manifest = Manifest::new(name, args.fps);
    manifest.provenance = format!(
        "garment {} on character {}, simulated by unic {}",
        args.garment.display(),
        args.character.display(),
        env!("CARGO_PKG_VERSION")
    );
    manifest.source = record.clone();
    manifest.contact_joints.clone_from(&args.contacts);
    manifest
}

/// The clips that are still to be made, and what is there of the others.
fn keep_finished<'a>(
    args: &SimulateArgs,
    writer: &mut CaptureWriter,
    jobs: &'a [Job],
) -> Result<(Vec<&'a Job>, Kept)> {
    let mut kept = Kept::default();
    let mut left = Vec::new();
    let rows = report::rows(&args.out);
    for job in jobs {
        if writer.keep_clip(&job.clip, job.split)? {
            kept.frames += job.clip.len() as u64;
            kept.rows
                .extend(rows.iter().find(|row| row.clip == job.clip.name).cloned());
        } else {
            left.push(job);
        }
    }
    Ok((left, kept))
}

fn announce(cut: &Cut, jobs: &[Job], kept: &Kept) {
    let seconds: f32 = jobs.iter().map(|job| job.clip.seconds()).sum();
    let vertices = cut.garment.rest.vertices.len();
    say(&format!(
        "{}, {seconds:.1} s of motion, {vertices} vertices",
        counted(jobs.len(), "clip")
    ));
    if kept.frames > 0 {
        say(&format!("{} frames are there already", kept.frames));
    }
    for job in jobs.iter().filter(|job| job.split != unic_io::Split::Train) {
        say(&format!("{} is held out for {}", job.clip.name, job.split.name()));
    }
}
