//! Arguments of the examples that search for panels in many pictures.

use std::ops::Range;
use std::path::Path;

use image::GrayImage;
use studies::random_scenes::photographs;

/// `COUNT [FOLDER OF PHOTOGRAPHS] [WIDTHxHEIGHT] [FIRST SEED]`; default: 100 in full HD from seed 0, with the studies' photographs.
pub struct Arguments {
    /// Random seeds.
    pub seeds: Range<u64>,
    /// Frame width and height in pixels.
    pub size: [usize; 2],
    /// Backgrounds of the panels.
    pub photographs: Vec<GrayImage>,
    /// The remaining arguments.
    pub rest: Vec<String>,
}

impl Arguments {
    /// Reads this program's arguments.
    pub fn read() -> Self {
        let mut arguments = std::env::args().skip(1);
        let count: u64 = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(100);
        let folder = arguments.next();
        let folder = folder
            .as_deref()
            .unwrap_or(concat!(env!("CARGO_MANIFEST_DIR"), "/../studies/photographs"));
        let size = arguments.next().and_then(|size| {
            let (width, height) = size.split_once('x')?;
            Some([width.parse().ok()?, height.parse().ok()?])
        });
        let first: u64 = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(0);
        Self {
            seeds: first..first + count,
            size: size.unwrap_or([1920, 1080]),
            photographs: photographs(Path::new(folder)).expect("a folder of pictures"),
            rest: arguments.collect(),
        }
    }
}
