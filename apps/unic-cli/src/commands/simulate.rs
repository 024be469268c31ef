//! The command `unic simulate`: simulates a garment in every motion and writes a capture.
//!
//! The order of [`run`] matters: everything that can be refused is refused before the solver
//! starts, and `capture.toml`, which marks the capture as complete, is written last.

mod folder;
mod inputs;
mod report;
mod work;

use crate::{
    args::{SimulateArgs, Switch},
    output::print_status,
};
use anyhow::{Result, anyhow};
use folder::FolderState;
use inputs::{GarmentInput, Job, distinct};
use report::SimulationSummary;
use std::{sync::Arc, time::Instant};
use unic_core::{character::Character, surface::Surface};
use unic_io::{CaptureWriter, Manifest, counted};
use unic_sim::{
    Attachment, Cloth, ClothSpec, Material, SimulationSettings,
    contact::{ContactSettings, Friction},
    self_contact::SelfContactSettings,
};
use work::{ClipRow, ClipSimulator, EarlierProgress};

/// Number of pictures in the strip of a clip.
const PICTURES: usize = 8;
/// Compliance of the attachment of pinned vertices to the body, m/N, as of elastic in a waistband.
const ATTACHMENT_COMPLIANCE: f32 = 1e-3;

/// Simulates every motion and writes a capture.
///
/// # Errors
/// Unusable options or inputs, files that cannot be read or written, an interruption.
pub(crate) fn run(args: &SimulateArgs) -> Result<()> {
    let started = Instant::now();
    folder::check_outputs(args)?;
    let character = inputs::character(args)?;
    args.force
        .check_findings(&args.character, &unic_io::check::character(&character))?;
    let input = inputs::garment(args, &character)?;
    args.force.check_findings(
        &args.garment,
        &unic_io::check::garment(&input.garment.rest, &character),
    )?;
    let jobs = inputs::jobs(args, &character)?;
    let settings = settings(args, &input);
    report::create_picture_folder(args, &jobs)?;
    let record = folder::record(args, &input, &jobs, &settings);
    let cloth = cloth(&input, &character).map_err(|e| anyhow!("{}: {e}", args.garment.display()))?;
    // The lock is held until the function returns: no other process writes into the folder.
    let (_lock, state) = folder::open(args, &record)?;
    let vertices = input.garment.rest.vertices.len();
    if state == FolderState::Finished {
        return report_finished(args, vertices, &jobs, started);
    }
    let mut writer = begin(args, &record, state, &character, &input)?;
    let plan = match state {
        FolderState::Unfinished => keep_finished(args, &mut writer, &jobs)?,
        _ => Plan {
            remaining: jobs.iter().collect(),
            earlier: EarlierProgress::default(),
        },
    };
    announce(&input, &jobs, &plan.earlier);
    let simulator = ClipSimulator {
        character: Arc::new(character),
        input: &input,
        cloth: Arc::new(cloth),
        settings,
        pictures: args.pictures.as_ref().map_or(0, |_| PICTURES),
    };
    let save_rows = |rows: &[ClipRow]| {
        report::write_summary(&SimulationSummary::new(args, vertices, rows, started.elapsed()))
    };
    let mut rows = plan.earlier.rows.clone();
    let finished = simulator.simulate_all(&plan.remaining, plan.earlier, &mut writer, &save_rows)?;
    rows.extend(finished.iter().map(|clip| clip.row.clone()));
    let summary = SimulationSummary::new(args, vertices, &rows, started.elapsed()).sorted(&jobs);
    report::write_summary(&summary)?;
    // Clips finish in any order. The manifest lists them as the command line does, so that a
    // resumed simulation gives the same bytes.
    writer.order_clips(jobs.iter().map(|job| job.clip.name.as_str()));
    // `capture.toml` is the last file: a folder that has it is a complete capture.
    writer.finish()?;
    folder::remove_record(&args.out)?;
    report::draw(args, &simulator, &finished)?;
    report::print_summary(args, &summary)
}

/// Clips that are still to be simulated, and the progress of an earlier run.
struct Plan<'a> {
    remaining: Vec<&'a Job>,
    earlier: EarlierProgress,
}

/// Prints the result of a simulation that an earlier run has finished.
///
/// Such a run may have been killed between its last two steps, so the record is removed again.
fn report_finished(args: &SimulateArgs, vertices: usize, jobs: &[Job], started: Instant) -> Result<()> {
    folder::remove_record(&args.out)?;
    let rows = report::stored_rows(&args.out);
    print_status(&format!("{} is already finished", args.out.display()));
    report::print_summary(
        args,
        &SimulationSummary::new(args, vertices, &rows, started.elapsed()).sorted(jobs),
    )
}

/// Writes the record and opens the capture for writing. A failure in an empty folder leaves it
/// empty.
fn begin(
    args: &SimulateArgs,
    record: &toml::Table,
    state: FolderState,
    character: &Character,
    input: &GarmentInput,
) -> Result<CaptureWriter> {
    if state == FolderState::Unfinished {
        folder::check_same_inputs(&args.out, character, input)?;
    }
    let manifest = manifest(args, record);
    let writer = folder::write_record(&args.out, record).and_then(|()| {
        let (garment, attributes) = (&input.garment, &input.attributes);
        let writer = CaptureWriter::create(&args.out, manifest, character, garment, attributes);
        Ok(writer?)
    });
    // Files of an unfinished simulation stay: a later --resume may still succeed.
    if writer.is_err() && state == FolderState::Empty {
        folder::clear(&args.out)?;
    }
    writer
}

fn settings(args: &SimulateArgs, input: &GarmentInput) -> SimulationSettings {
    let default = SimulationSettings::default();
    // Contact has one thickness and one friction for the whole garment: those of the fabric that
    // covers most faces.
    let material = most_common(&input.materials);
    SimulationSettings {
        fps: args.fps,
        // Substeps are spread evenly over the intervals of a frame, rounded up.
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

/// Material of most faces. Cotton for a garment without faces.
fn most_common(materials: &[Material]) -> Material {
    let count = |material: &Material| materials.iter().filter(|m| *m == material).count();
    let distinct = distinct(materials);
    let most = distinct.into_iter().max_by_key(|material| count(material));
    most.unwrap_or(Material::COTTON)
}

/// Cloth for the solver. Pinned vertices are attached to the nearest body point of the rest pose.
fn cloth(input: &GarmentInput, character: &Character) -> Result<Cloth, unic_sim::ClothError> {
    let materials = distinct(&input.materials);
    let index = |material: &Material| materials.iter().position(|m| m == material).unwrap_or(0) as u16;
    let face_materials = input.materials.iter().map(index).collect();
    let surface = Surface::build(&character.body);
    let pinned = input.attributes.pinned.iter().flatten().enumerate();
    let pinned = pinned.filter(|(_, is_pinned)| **is_pinned).map(|(v, _)| v);
    let attachments = pinned.filter_map(|v| {
        let position = input.garment.rest.vertices[v];
        let attachment = Attachment::to_nearest(v as u32, position, &character.body, &surface)?;
        Some(Attachment {
            compliance: ATTACHMENT_COMPLIANCE,
            ..attachment
        })
    });
    Cloth::new(&ClothSpec {
        rest: input.garment.rest.clone(),
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

/// Adds the finished clips of an earlier run to the capture and plans the others.
fn keep_finished<'a>(args: &SimulateArgs, writer: &mut CaptureWriter, jobs: &'a [Job]) -> Result<Plan<'a>> {
    let mut earlier = EarlierProgress::default();
    let mut remaining = Vec::new();
    let rows = report::stored_rows(&args.out);
    for job in jobs {
        if writer.keep_clip(&job.clip, job.split)? {
            earlier.frames += job.clip.len() as u64;
            earlier
                .rows
                .extend(rows.iter().find(|row| row.clip == job.clip.name).cloned());
        } else {
            remaining.push(job);
        }
    }
    Ok(Plan { remaining, earlier })
}

/// Prints what is about to be simulated.
fn announce(input: &GarmentInput, jobs: &[Job], earlier: &EarlierProgress) {
    let seconds: f32 = jobs.iter().map(|job| job.clip.seconds()).sum();
    let vertices = input.garment.rest.vertices.len();
    print_status(&format!(
        "{}, {seconds:.1} s of motion, {vertices} vertices",
        counted(jobs.len(), "clip")
    ));
    if earlier.frames > 0 {
        print_status(&format!("{} frames are kept from an earlier run", earlier.frames));
    }
    for job in jobs.iter().filter(|job| job.split != unic_io::Split::Train) {
        print_status(&format!("{} is held out for {}", job.clip.name, job.split.name()));
    }
}
