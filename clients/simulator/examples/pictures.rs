//! Writes pictures, depth and the truth mesh of every scene for looking at:
//! `cargo run -p simulator --example pictures -- DIR [SEED] [SCENE]`.

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use geometry::Rgb;
use simulator::{SceneConfig, SceneKind, Simulation};

/// The last one is blurred by a jerk.
const SHOWN_FRAMES: [u32; 5] = [0, 40, 90, 150, 182];
const JERK_FRAME: u32 = 180;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("usage: pictures DIR [SEED] [SCENE]")?);
    let seed = arguments.next().map_or(Ok(1), |seed| seed.parse())?;
    let only: Option<SceneKind> = arguments.next().map(|name| name.parse()).transpose()?;
    for scene in SceneKind::ALL.into_iter().filter(|kind| only.is_none_or(|only| only == *kind)) {
        let begun = Instant::now();
        let simulation = Simulation::new(&SceneConfig {
            scene,
            seed,
            jerk_mm: 25.0,
            jerk_frame: JERK_FRAME,
            ..configured()?
        })?;
        eprintln!("{scene}: built in {:?}", begun.elapsed());
        std::fs::write(folder.join(format!("{scene}_truth_mesh.npz")), simulation.truth_mesh().to_npz()?)?;
        for frame in SHOWN_FRAMES {
            let begun = Instant::now();
            let pair = simulation.frame(frame)?;
            eprintln!("{scene} {frame}: {:?}", begun.elapsed());
            for (eye, picture) in [("left", &pair.left), ("right", &pair.right)] {
                save(&folder.join(format!("{scene}_{frame:03}_{eye}.png")), picture)?;
            }
            let depth: Vec<u8> = pair.depth.pixels().iter().flat_map(|z| z.to_le_bytes()).collect();
            std::fs::write(folder.join(format!("{scene}_{frame:03}_depth.f32")), depth)?;
        }
    }
    Ok(())
}

/// The section `[simulate]` of the server's configuration.
fn configured() -> Result<SceneConfig, Box<dyn Error>> {
    let all: toml::Table = include_str!("../../../config/server.toml").parse()?;
    let section = all.get("simulate").ok_or("config/server.toml has no section [simulate]")?;
    Ok(section.clone().try_into()?)
}

fn save(path: &std::path::Path, picture: &Rgb) -> Result<(), Box<dyn Error>> {
    let bytes: Vec<u8> = picture.pixels().iter().flatten().copied().collect();
    Ok(image::save_buffer(path, &bytes, picture.width(), picture.height(), image::ColorType::Rgb8)?)
}
