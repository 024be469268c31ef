use std::{path::Path, sync::Arc};
use unic_train::*;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let preset = match args[0].as_str() {
        "paper" => Preset::Paper,
        "tiny" => Preset::Tiny,
        _ => Preset::Standard,
    };
    let (hold, rest): (Vec<String>, Vec<String>) = args[1..]
        .iter()
        .cloned()
        .partition(|a| a.starts_with("hold=") || a.starts_with("out="));
    let config = TrainConfig::preset(preset).with_assignments(&rest).unwrap();
    let mut capture = unic_io::Capture::open(Path::new("../shared/data/captures/tshirt_blender")).unwrap();
    for h in hold.iter().filter_map(|h| h.strip_prefix("hold=")) {
        let held: Vec<String> = h.split(',').map(String::from).collect();
        capture.manifest.splits.train.retain(|c| !held.contains(c));
        capture.manifest.splits.validation = held;
    }
    let out = hold.iter().find_map(|h| h.strip_prefix("out=")).map(String::from);
    let test = capture.load_clip("run_02_03").unwrap();
    let data = Dataset::new(capture, &config).unwrap();
    let spec = data.config.motion.clone();
    let test = vec![unic_eval::PreparedClip::new(
        &spec,
        &data.capture.character.skeleton,
        test,
    )];
    let held: Vec<_> = data.validation.iter().map(|c| vec![c.clone()]).collect();
    let train: Vec<_> = data.clips.iter().take(3).cloned().collect();
    let mut trainer = Trainer::new(data, config).unwrap();
    let mut sum = (0.0, 0.0, 0);
    let folder = out.as_ref().map(|o| {
        let f = format!("{o}.run/checkpoints");
        std::fs::create_dir_all(&f).unwrap();
        f
    });
    trainer
        .run(folder.as_ref().map(Path::new), &mut |event| {
            match event {
                Event::Step {
                    step, loss, seconds, ..
                } => {
                    sum.0 += *loss as f64;
                    sum.1 += seconds;
                    sum.2 += 1;
                    if step % 250 == 0 {
                        eprintln!(
                            "{step} loss {:.3} {:.1} ms",
                            sum.0 / sum.2 as f64,
                            1e3 * sum.1 / sum.2 as f64
                        );
                        sum = (0.0, 0.0, 0);
                    }
                }
                Event::Validated {
                    step, rmse, seconds, ..
                } => eprintln!("{step} validation {:.2} mm in {seconds:.2} s", 1e3 * rmse),
                _ => {}
            }
            Control::Continue
        })
        .unwrap();
    let model = Arc::new(trainer.model().unwrap());
    let r = |c: &[unic_eval::PreparedClip]| 1e3 * free_running_rmse(&model, c).unwrap();
    let each: Vec<String> = held
        .iter()
        .map(|h| format!("{} {:.2}", h[0].name(), r(h)))
        .collect();
    println!(
        "RESULT {} | held {} | test {:.2} | train {:.2} | {:.0} s",
        args.join(" "),
        each.join(", "),
        r(&test),
        r(&train),
        trainer.seconds()
    );
    if let Some(out) = out {
        std::fs::write(out, model.to_bytes().unwrap()).unwrap();
    }
}
