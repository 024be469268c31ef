//! Prints what a file holds.
use std::path::Path;
use unic_scene::{Content, Format, Request};

fn main() {
    for path in std::env::args().skip(1) {
        let path = Path::new(&path);
        let format = match path.extension().is_some_and(|e| e == "fbx") {
            true => Format::Fbx,
            false => Format::Usd,
        };
        let request = |content| Request {
            content,
            ..Default::default()
        };
        match unic_scene::read(path, format, &request(Content::Outline)) {
            Err(fault) => println!("{}: {fault}", path.display()),
            Ok(scene) => {
                println!(
                    "{}: {:?} {} animations {:?} notes {:?}",
                    path.display(),
                    scene.generator,
                    scene.units,
                    scene.animations,
                    scene.notes
                );
                for node in &scene.nodes {
                    println!("  node {} {:?} {:?}", node.name, node.parent, node.local);
                }
                for (i, mesh) in scene.meshes.iter().enumerate() {
                    println!("  mesh {mesh:?}");
                    let t = std::time::Instant::now();
                    match unic_scene::read(path, format, &request(Content::Points(i))) {
                        Ok(s) => println!(
                            "    points {:?} {:?}",
                            s.meshes[i].points.as_ref().map(|p| (p.fps, p.frames.len())),
                            t.elapsed()
                        ),
                        Err(e) => println!("    {e}"),
                    }
                }
                match unic_scene::read(path, format, &request(Content::Motion)) {
                    Ok(s) => println!(
                        "  motion {:?}",
                        s.motion
                            .map(|m| (m.name, m.fps, m.rate, m.frames, m.tracks.len()))
                    ),
                    Err(e) => println!("  motion {e}"),
                }
            }
        }
    }
}
