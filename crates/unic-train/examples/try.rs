use std::{path::Path, sync::Arc};
use unic_train::*;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let preset = match args[0].as_str() { "paper" => Preset::Paper, "tiny" => Preset::Tiny, _ => Preset::Standard };
    let config = TrainConfig::preset(preset).with_assignments(&args[1..]).unwrap();
    let capture = unic_io::Capture::open(Path::new("../shared/data/captures/tshirt_blender")).unwrap();
    let test = capture.load_clip("run_02_03").unwrap();
    let data = Dataset::new(capture, &config).unwrap();
    println!("scale {:?}", data.config.state);
    println!("validation {}", data.validation[0].name());
    let spec = data.config.motion.clone();
    let test = vec![unic_eval::PreparedClip::new(&spec, &data.capture.character.skeleton, test)];
    let mut trainer = Trainer::new(data, config).unwrap();
    let mut sum = (0.0, 0.0, 0);
    trainer.run(None, &mut |event| { match event {
        Event::Step { step, loss, gradient_norm, seconds, .. } => { sum.0 += *loss as f64; sum.1 += seconds; sum.2 += 1;
            if step % 50 == 0 { println!("{step} loss {:.3} norm {gradient_norm:.2} {:.1} ms", sum.0 / sum.2 as f64, 1e3 * sum.1 / sum.2 as f64); sum = (0.0, 0.0, 0); } }
        Event::Validated { step, rmse, seconds, .. } => println!("{step} validation {:.2} mm in {seconds:.2} s", 1e3 * rmse),
        _ => {} } Control::Continue }).unwrap();
    let model = Arc::new(trainer.model().unwrap());
    println!("test {:.2} mm", 1e3 * free_running_rmse(&model, &test).unwrap());
}
