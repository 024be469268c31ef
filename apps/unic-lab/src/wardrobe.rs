//! `unic-lab wardrobe`: the garments that the pretrained unit learns from.

use crate::args::WardrobeArgs;
use anyhow::Result;
use unic_builtin::{
    garments::{FlaredSkirt, GarmentError, GarmentMesh, TShirt},
    human::{HumanParameters, human},
};
use unic_cli::{
    output::print,
    outputs::{Existing, Outputs},
};
use unic_core::character::Character;
use unic_io::{NpzWriter, write_obj};

/// Constructor of a garment, cut to the size of a character.
type Maker = fn(&Character) -> Result<GarmentMesh, GarmentError>;

/// Shirts and skirts of other cuts than those that come with `unic`, in large triangles: the unit
/// learns how they follow a motion, not their wrinkles.
const GARMENTS: [(&str, Maker); 4] = [
    ("loose_shirt", |c| {
        let cut = TShirt {
            ease_m: 0.05,
            sleeve_m: 0.25,
            hem_m: 0.02,
            neck_m: 0.05,
            edge_m: 0.03,
        };
        cut.make(c)
    }),
    ("tight_shirt", |c| {
        let cut = TShirt {
            ease_m: 0.012,
            sleeve_m: 0.14,
            hem_m: 0.15,
            neck_m: 0.03,
            edge_m: 0.028,
        };
        cut.make(c)
    }),
    ("long_skirt", |c| {
        let cut = FlaredSkirt {
            length_m: 0.75,
            flare: 0.4,
            ease_m: 0.01,
            edge_m: 0.036,
        };
        cut.make(c)
    }),
    ("short_skirt", |c| {
        let cut = FlaredSkirt {
            length_m: 0.36,
            flare: 0.8,
            ease_m: 0.006,
            edge_m: 0.026,
        };
        cut.make(c)
    }),
];

/// Writes a folder for each garment.
pub(crate) fn run(args: &WardrobeArgs) -> Result<()> {
    let character = human(&HumanParameters::default())?;
    let folders = || GARMENTS.iter().map(|(name, make)| (args.out.join(name), make));
    let files = folders().flat_map(|(folder, _)| ["garment.obj", "garment.npz"].map(|f| folder.join(f)));
    Outputs::default()
        .files(files)
        .check(Existing::of(args.overwrite))?;
    for (folder, make) in folders() {
        let garment = make(&character)?;
        std::fs::create_dir_all(&folder)?;
        write_obj(&folder.join("garment.obj"), &garment.mesh)?;
        let mut arrays = NpzWriter::create(&folder.join("garment.npz"))?;
        arrays.bools("pinned", &garment.attached())?;
        arrays.finish()?;
        print(&format!(
            "{}: {} vertices\n",
            folder.display(),
            garment.mesh.vertices.len()
        ))?;
    }
    Ok(())
}
