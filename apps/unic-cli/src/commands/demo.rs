//! `unic demo`: the other commands, one after another.

mod stages;

use crate::{
    args::DemoArgs,
    failure::{Interrupted, Usage},
    folder_lock::FolderLock,
    output::{self, print, print_status},
    outputs::{Existing, Outputs},
};
use anyhow::{Context, Result};
use serde::Serialize;
use stages::{Scale, garment, quoted, scale, show, stages};
use std::{fs, path::Path, time::Instant};

/// Name of the file that records the demo's settings. A demo with other settings does not continue
/// it.
const RECORD: &str = "demo.toml";

/// Content of [`RECORD`].
#[derive(Serialize)]
struct Record {
    garment: String,
    quick: bool,
    #[serde(flatten)]
    scale: Scale,
}

/// Runs the stages whose results the folder lacks.
pub(crate) fn run(args: &DemoArgs) -> Result<()> {
    let started = Instant::now();
    Outputs::default()
        .folder(&args.out, [])
        .check(Existing::Resumed)?;
    // Each stage locks its own folder below this one.
    let _lock = FolderLock::acquire(&args.out)?;
    open(args)?;
    let stages = stages(args);
    let mut done = Vec::new();
    for (i, stage) in stages.iter().enumerate() {
        let title = format!("[{}/{}] {}", i + 1, stages.len(), stage.title);
        let was_there = stage.leaves.exists();
        let begun = Instant::now();
        match was_there {
            true => print_status(&format!("{title}: {} is there", stage.leaves.display())),
            false => {
                print_status(&format!("\n{title}\n  unic {}", stage.line()));
                let _stage = args.json.then(output::redirect_results_to_stderr);
                stage.run().map_err(|error| with_demo_command(error, args))?;
            }
        }
        done.push(Done {
            title: stage.title,
            command: format!("unic {}", stage.line()),
            leaves: &stage.leaves,
            was_there,
            seconds: begun.elapsed().as_secs_f64(),
        });
    }
    close(args, &done, started)
}

/// The object of `--json`.
#[derive(Serialize)]
struct Summary<'a> {
    folder: &'a Path,
    /// Time of the whole command.
    seconds: f64,
    stages: &'a [Done<'a>],
}

/// One stage in [`Summary`].
#[derive(Serialize)]
struct Done<'a> {
    title: &'static str,
    command: String,
    leaves: &'a Path,
    /// Made by an earlier run.
    was_there: bool,
    seconds: f64,
}

fn open(args: &DemoArgs) -> Result<()> {
    let out = &args.out;
    let path = out.join(RECORD);
    let record = record(args)?;
    if args.overwrite && path.exists() {
        clear(args)?;
        unic_io::atomic::write(&path, record.as_bytes())?;
    }
    match fs::read_to_string(&path) {
        Ok(before) if before != record => {
            let text = format!(
                "{}: expected a demo of the same garment, motions and training, found another; --overwrite \
                 replaces it",
                path.display()
            );
            Err(Usage(text).into())
        }
        Ok(_) => Ok(()),
        Err(_) => {
            refuse_foreign(args)?;
            fs::create_dir_all(out)
                .with_context(|| format!("{}: the folder cannot be made", out.display()))?;
            Ok(unic_io::atomic::write(&path, record.as_bytes())?)
        }
    }
}

/// Refuses a folder with files of other work, which stages would take for their own or replace.
fn refuse_foreign(args: &DemoArgs) -> Result<()> {
    let leaves = stages(args).into_iter().map(|stage| stage.leaves);
    let folders = ["capture", "demo.run"].map(|name| args.out.join(name));
    match leaves.chain(folders).find(|path| path.exists()) {
        None => Ok(()),
        Some(found) => {
            let found = found.display();
            let text = format!("--out: expected an empty folder or a demo's, found {found}");
            Err(Usage(text).into())
        }
    }
}

/// Settings of the demo as text. Finished stages are kept only for equal settings.
fn record(args: &DemoArgs) -> Result<String> {
    let (garment, quick) = (garment(args), args.quick);
    let scale = scale(args);
    Ok(toml::to_string(&Record {
        garment,
        quick,
        scale,
    })?)
}

/// Removes the results of the stages and the files that they would resume, so that they run again.
fn clear(args: &DemoArgs) -> Result<()> {
    let leaves = stages(args).into_iter().map(|stage| stage.leaves);
    let begun = ["capture/simulation.toml", "demo.run/config.toml"].map(|name| args.out.join(name));
    for path in leaves.chain(begun).filter(|path| path.exists()) {
        fs::remove_file(&path).with_context(|| format!("{} cannot be removed", path.display()))?;
    }
    Ok(())
}

/// Replaces a stage's advice on how to continue by the demo's own command, which is shorter.
fn with_demo_command(error: anyhow::Error, args: &DemoArgs) -> anyhow::Error {
    match error.chain().any(|e| e.is::<Interrupted>()) {
        false => error,
        true => {
            let quick = if args.quick { " --quick" } else { "" };
            let (garment, out) = (garment(args), show(&args.out));
            let out = quoted(&out);
            let text = format!("stopped; `unic demo --garment {garment}{quick} --out {out}` continues");
            Interrupted(text).into()
        }
    }
}

fn close(args: &DemoArgs, stages: &[Done], started: Instant) -> Result<()> {
    let seconds = started.elapsed().as_secs_f64();
    if args.json {
        return output::print_json(&Summary {
            folder: &args.out,
            seconds,
            stages,
        });
    }
    let out = args.out.display();
    print(&format!(
        "\nDone in {seconds:.0} s.\n  {out}/report.html    open it in a browser\n  {out}/animation.glb  open it in \
         Blender\n  {out}/animation.png  pictures of it\n  {out}/demo.unic      the model: unic animate {out}/demo.unic --motion YOURS.npz --out walk.glb\n"
    ))
}
