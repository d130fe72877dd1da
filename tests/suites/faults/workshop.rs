//! The working folder of a command, with all inputs, and its output.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::commands::Work;

/// The folder of the inputs, which are created once and copied.
pub struct Workshop {
    vocc: PathBuf,
    inputs: tempfile::TempDir,
}

/// File contents by name.
pub type Files = BTreeMap<String, Vec<u8>>;

const PLAN: &str = "\
frames = 1024
[set]
camera.width_px = 320
camera.height_px = 240
[grid]
pose.distance_m = [60, 70]
";

/// Exceeds any timeout.
const LONGEST: &str = "\
frames = 1000000000000
detectors = [\"ml\", \"best\"]
[grid]
pose.distance_m = [30, 40, 50, 60, 70]
";

impl Workshop {
    /// Creates all inputs.
    pub fn new(vocc: PathBuf) -> Self {
        let inputs = tempfile::tempdir().expect("a folder");
        let workshop = Self { vocc, inputs };
        let write = |name: &str, bytes: &[u8]| {
            std::fs::write(workshop.inputs.path().join(name), bytes).expect("room");
        };
        write("plan.toml", PLAN.as_bytes());
        write("message.txt", b"bend ahead");
        write("orders.txt", b"light 500\nrestart\n");
        write("longest.toml", LONGEST.as_bytes());
        write("long.txt", &[0xff; 1024]);
        write("grey.pgm", &[&b"P5 320 240 255\n"[..], &[90; 320 * 240]].concat());
        write("broken.png", b"\x89PNG\r\n\x1a\n");
        // A picture full of LEDs.
        let dots = image::GrayImage::from_fn(8192, 8192, |x, y| image::Luma([if x % 16 < 6 && y % 16 < 6 { 230 } else { 40 }]));
        dots.save(workshop.inputs.path().join("widest.png")).expect("room");
        write("reach.toml", include_bytes!("../../../docs/optimum/kmeans.toml"));
        for (shard, file) in [("0/2", "shard-0.json"), ("1/2", "shard-1.json")] {
            workshop.make(&["evaluate", "--frames", "1024", "--shard", shard, "--out", file]);
        }
        workshop.make(&words("optimize --frames 64 --intervals 1 --distances 50 -o table.toml"));
        write("scene.toml", &workshop.make(&["scene", "night"]));
        workshop.make(&["keys", "new", "key.toml"]);
        workshop.make(&["sweep", "plan.toml", "--out", "half", "--shard", "0/2"]);
        let film =
            words("link day --level fast --message hi --frames 30 --save frames --set camera.width_px=320 --set camera.height_px=240");
        workshop.make(&film);
        let frames = workshop.inputs.path().join("frames");
        std::fs::copy(frames.join("frame-000000.png"), workshop.inputs.path().join("frame.png")).expect("a frame");
        workshop.make_duties();
        let mut names: Vec<PathBuf> = std::fs::read_dir(&frames)
            .expect("frames")
            .map(|entry| entry.expect("a file").path())
            .collect();
        names.sort();
        let pixels = names
            .iter()
            .flat_map(|path| image::open(path).expect("a frame").into_luma8().into_raw());
        write("film.raw", &pixels.collect::<Vec<u8>>());
        workshop
    }

    /// Pictures of a panel at four duties, in front of a wall as grey as a grey card.
    fn make_duties(&self) {
        std::fs::create_dir(self.inputs.path().join("duties")).expect("room");
        for (duty, l2a) in [("1", 8), ("0.5", 4), ("0.25", 2), ("0.125", 1)] {
            let (file, l2a) = (format!("duties/duty-{duty}.png"), format!("link.l2a={l2a}"));
            let sets = [
                "camera.width_px=400",
                "camera.height_px=400",
                "camera.exposure_bias_ev=-4",
                "pose.distance_m=5",
                "ambient.background_reflectance=0.18",
                "panel.pwm_hz=0",
                &l2a,
            ];
            let render = ["render", "day", "--bits", "0123456789abcdef", "--out", &file];
            let sets = sets.iter().flat_map(|&set| ["--set", set]);
            self.make(&render.into_iter().chain(sets).collect::<Vec<_>>());
        }
    }

    /// The program.
    pub fn vocc(&self) -> &Path {
        &self.vocc
    }

    /// The output of an undisturbed command.
    fn make(&self, arguments: &[&str]) -> Vec<u8> {
        let output = Command::new(&self.vocc)
            .args(arguments)
            .current_dir(self.inputs.path())
            .stdin(Stdio::null())
            .output()
            .expect("vocc runs");
        let is_done = output.status.code().is_some_and(|status| status < 2);
        assert!(is_done, "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    }

    /// Creates a folder with all inputs.
    pub fn folder(&self) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, bytes) in files(self.inputs.path()) {
            put(folder.path(), &name, &bytes);
        }
        folder
    }

    /// The files that a command wrote into its folder.
    pub fn written(&self, folder: &Path) -> Files {
        let inputs = files(self.inputs.path());
        let mut files = files(folder);
        files.retain(|name, bytes| inputs.get(name) != Some(bytes));
        files
    }
}

/// Name of the pipe without a writer.
pub const PIPE: &str = "pipe";

/// Removes a file.
pub fn clear(folder: &Path, name: &str) {
    std::fs::remove_file(folder.join(name)).expect("it is there");
}

/// Writes a file, and creates its parent folders.
pub fn put(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, bytes).expect("room");
}

fn files(folder: &Path) -> Files {
    let mut found = Files::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(inner) = folders.pop() {
        for entry in std::fs::read_dir(&inner).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.is_file() {
                let name = path.strip_prefix(folder).expect("inside").display().to_string();
                found.insert(name, std::fs::read(&path).expect("a file"));
            }
        }
    }
    found
}

impl Work {
    /// Its arguments.
    pub fn arguments(&self) -> impl Iterator<Item = &'static str> {
        self.arguments.split_whitespace()
    }

    /// Number of its inputs.
    pub fn inputs(&self) -> usize {
        self.arguments().filter(|text| text.starts_with('<')).count()
    }

    /// Whether it writes files.
    pub fn writes(&self) -> bool {
        self.arguments().any(|text| text.starts_with('@'))
    }
}

/// Splits a command line without quotes.
fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}
