//! Whole inputs of every kind, and runs over them.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rand_chacha::ChaCha8Rng;
use vocc_tests::programs::read_aside;
use vocc_tests::simulated_board::SimulatedBoard;

use crate::board;
use crate::kinds::Kind;

/// Address space of a run, in bytes.
const MEMORY: u64 = 4 << 30;
/// Time after which a run is asked to end, as damage may have made its work long.
const LONG: Duration = Duration::from_secs(4);
/// The same for an input that is whole.
const FOR_EVER: Duration = Duration::from_secs(300);
/// Time within which it then ends: a second, on a machine that is busy.
const PATIENCE: Duration = Duration::from_secs(20);
/// Signal of Ctrl-C.
const INTERRUPT: i32 = 2;

/// Name of an empty file.
const EMPTY: &str = "empty";

const PLAN: &str = "frames = 256\n[set]\ncamera.width_px = 320\ncamera.height_px = 240\n[grid]\npose.distance_m = [60, 70]\n";
const OPENCV: &str = include_str!("opencv.yml");
const ROS: &str = include_str!("ros.yaml");
const CAMERA_INFO: &str = include_str!("camera_info.yaml");
const CAMERA: &str = "\
encoding = { gamma = 2.2 }
black_grey = 1.5
blur_sigma_px = 1.2
read_noise_e = 4
line_delay_exposures = 0.02
channel = \"brightest\"
focal_length_mm = 25
pixel_pitch_um = 6.875
principal_px = [159.5, 119.5]
distortion = [-0.1, 0.01, 0.001, 0.001, 0]
";
/// A key that is the same in each run: that of RFC 8032, 7.1, test 1.
const KEY: &str = "\
# A private key: whoever has it signs as its owner. `vocc keys show` prints the public one.
name = \"key\"
public = \"d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a\"
secret = \"9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60\"
";
const STAMPS: &str = "frame,seconds\n0,17.00\n1,17.01\n2,17.02\n# late\n3,17.03\n";
const LOG: &str = "\
[info] Input #0, mov,mp4,m4a,3gp,3g2,mj2, from 'file:film.mp4':
[showinfo@times @ 0x55] [info] config in time_base: 1/100, frame_rate: 100/1
[showinfo@times @ 0x55] [info] n:   0 pts:      0 pts_time:0
[showinfo@times @ 0x55] [info] n:   1 pts:      1 pts_time:0.01
[showinfo@times @ 0x55] [info] n:   2 pts:      2 pts_time:0.02
[h264 @ 0x55] [warning] one packet was late
[showinfo@times @ 0x55] [info] n:   3 pts:      3 pts_time:0.03
";

/// The folder of the inputs, which are created once.
pub struct Workshop {
    vocc: PathBuf,
    inputs: tempfile::TempDir,
    board: Mutex<SimulatedBoard>,
}

/// How a run ended.
pub struct Ended {
    /// Exit status.
    pub status: i32,
    /// Standard output.
    pub printed: String,
    /// Standard error.
    pub errors: String,
}

impl Ended {
    /// Whether it prints a word.
    pub fn says(&self, word: &str) -> bool {
        self.printed.contains(word) || self.errors.contains(word)
    }
}

impl Workshop {
    /// Makes all inputs.
    pub fn new(vocc: PathBuf) -> Self {
        let inputs = tempfile::tempdir().expect("a folder");
        let board = Mutex::new(SimulatedBoard::start(&vocc));
        let workshop = Self { vocc, inputs, board };
        workshop.write(EMPTY, b"");
        workshop.make("link day --level fast --message hi --frames 4 --save frames --set camera.width_px=320 --set camera.height_px=240");
        workshop.write_pictures();
        workshop.write("frames/timestamps.csv", STAMPS.as_bytes());
        workshop.write("log", LOG.as_bytes());
        workshop.write("film.mp4", b"for the ffmpeg below");
        workshop.write_ffmpeg();
        let scene = workshop.make("scene night");
        workshop.write("scene.toml", &scene);
        workshop.write("plan.toml", PLAN.as_bytes());
        workshop.make("sweep plan.toml --out half --shard 0/2");
        workshop.make("evaluate --frames 512 --shard 0/2 --out shard-0.json");
        workshop.make("evaluate --frames 512 --shard 1/2 --out shard-1.json");
        workshop.make("optimize --frames 64 --intervals 1 --distances 50 -o table.toml");
        workshop.write("reach.toml", include_bytes!("../../../docs/optimum/kmeans.toml"));
        workshop.write("opencv.yml", OPENCV.as_bytes());
        workshop.write("ros.yaml", ROS.as_bytes());
        workshop.write("camera_info.yaml", CAMERA_INFO.as_bytes());
        workshop.write("camera.toml", CAMERA.as_bytes());
        workshop.write("key.toml", KEY.as_bytes());
        std::fs::set_permissions(workshop.inputs.path().join("key.toml"), Permissions::from_mode(0o600)).expect("set");
        let keys = workshop.make("keys show key.toml");
        workshop.write("keys.toml", &keys);
        workshop.make(
            "link day --level fast --message hi --frames 60 --sign key.toml --counter 7 --save signed --set camera.width_px=160 --set \
             camera.height_px=120",
        );
        workshop.make("receive signed --trust keys.toml --counters counters.toml");
        workshop.write("message", "Glatteis auf der Brücke".as_bytes());
        workshop.write("orders", b"light 500\nsensor stuck\nsensor works\nrestart\n");
        workshop.make("device simulate --flash flash");
        let panel = String::from_utf8(workshop.make("device calibration --template")).expect("text");
        let panel = panel.replace("luminance_full_cd_m2 = 0.0", "luminance_full_cd_m2 = 900.0");
        workshop.write("panel.toml", panel.as_bytes());
        workshop.write("program.elf", &program());
        workshop
    }

    /// An input that is at its end: a simulated board ends with it, and not with /dev/null.
    fn empty(&self) -> Stdio {
        std::fs::File::open(self.inputs.path().join(EMPTY)).expect("there").into()
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.inputs.path().join(name), bytes).expect("room");
    }

    /// A frame in all kinds of pictures, and films of some.
    fn write_pictures(&self) {
        let frames = |number: u32| image::open(self.inputs.path().join(format!("frames/frame-{number:06}.png"))).expect("a frame");
        let path = |name: &str| self.inputs.path().join(name);
        let frame = frames(1);
        let grey = frame.to_luma8();
        let deep = image::ImageBuffer::from_fn(320, 240, |x, y| {
            let light = (f64::from(grey.get_pixel(x, y).0[0]) / 255.0).powf(2.2);
            image::Luma([(4095.0 * light).round() as u16])
        });
        for name in ["grey.png", "grey.jpg", "grey.pgm"] {
            grey.save(path(name)).expect("room");
        }
        deep.save(path("deep.png")).expect("room");
        frame.to_rgba8().save(path("colour.png")).expect("room");
        let samples = deep.as_raw().iter().flat_map(|sample| sample.to_be_bytes());
        self.write(
            "deep.pgm",
            &b"P5 320 240 4095\n".iter().copied().chain(samples).collect::<Vec<u8>>(),
        );
        let text: Vec<String> = grey.as_raw()[..64].iter().map(u8::to_string).collect();
        self.write(
            "text.pgm",
            format!("P2\n# eight by eight\n8 8 255\n{}\n", text.join(" ")).as_bytes(),
        );
        let film: Vec<Vec<u8>> = (0..4).map(|number| frames(number).to_luma8().into_raw()).collect();
        self.write("film.raw", &film.concat());
        let mut y4m = b"YUV4MPEG2 W320 H240 F100:1 Ip C420jpeg\n".to_vec();
        let mut deep_y4m = b"YUV4MPEG2 W320 H240 F100:1 Ip Cmono10 XCOLORRANGE=FULL\n".to_vec();
        for frame in &film {
            y4m.extend(b"FRAME\n".iter().chain(frame));
            y4m.extend([128; 160 * 120 * 2]);
            deep_y4m.extend(b"FRAME\n");
            deep_y4m.extend(frame.iter().flat_map(|&grey| (u16::from(grey) << 2).to_le_bytes()));
        }
        self.write("film.y4m", &y4m);
        self.write("deep.y4m", &deep_y4m);
    }

    /// An ffmpeg that is a script: it writes the log and the film.
    fn write_ffmpeg(&self) {
        let folder = self.inputs.path().join("bin");
        std::fs::create_dir(&folder).expect("a folder");
        let program = folder.join("ffmpeg");
        std::fs::write(&program, "#!/bin/sh\ncat log >&2\nexec cat film.y4m\n").expect("room");
        std::fs::set_permissions(&program, std::os::unix::fs::PermissionsExt::from_mode(0o755)).expect("set");
    }

    /// The output of a command that makes inputs.
    fn make(&self, command: &str) -> Vec<u8> {
        let output = Command::new(&self.vocc)
            .args(command.split_whitespace())
            .current_dir(self.inputs.path())
            .stdin(self.empty())
            .output()
            .expect("vocc runs");
        let is_done = output.status.code().is_some_and(|status| status < 2);
        assert!(is_done, "{command}: {}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    }

    /// A kind's whole file.
    pub fn whole(&self, kind: &Kind) -> Vec<u8> {
        match kind.file {
            "" => Vec::new(),
            file => std::fs::read(self.inputs.path().join(file)).unwrap_or_else(|error| panic!("{file}: {error}")),
        }
    }

    /// Runs a kind's command over `bytes` in its file's place. `random`, if given, damages what a board answers.
    pub fn run(&self, kind: &Kind, bytes: &[u8], random: Option<&mut ChaCha8Rng>, as_json: bool) -> Result<Ended, String> {
        // A whole input may take its time.
        let long = if random.is_some() { LONG } else { FOR_EVER };
        let folder = tempfile::tempdir().expect("a folder");
        copy(self.inputs.path(), folder.path(), kind.file);
        let file = folder.path().join(kind.file);
        if !kind.file.is_empty() {
            std::fs::write(&file, bytes).expect("room");
            // A key that others may read is refused.
            let whole = self.inputs.path().join(kind.file).metadata().expect("there");
            std::fs::set_permissions(&file, whole.permissions()).expect("set");
        }
        let is_alone = kind.file.is_empty();
        let has_port = kind.command.contains('%');
        let board = has_port.then(|| self.board.lock().unwrap_or_else(std::sync::PoisonError::into_inner));
        let line = board.as_ref().map(|board| board::line(board, random.filter(|_| is_alone).cloned()));
        let port = line.as_ref().map_or("", |line| &line.port);
        let words = kind.command.split_whitespace().map(|word| match word {
            "%" => port.to_owned(),
            word => word.replace("{}", kind.file),
        });
        let paths = [
            folder.path().join("bin").into_os_string(),
            std::env::var_os("PATH").unwrap_or_default(),
        ];
        let mut run = Command::new("prlimit")
            .arg(format!("--as={MEMORY}"))
            .arg(&self.vocc)
            .args(words)
            .args(as_json.then_some("--json"))
            .current_dir(folder.path())
            .env("PATH", paths.join(std::ffi::OsStr::new(":")))
            .stdin(match kind.is_input {
                true => std::fs::File::open(&file).expect("there").into(),
                false => self.empty(),
            })
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("prlimit runs");
        let printed = read_aside(run.stdout.take());
        let errors = read_aside(run.stderr.take());
        let begun = Instant::now();
        let mut asked: Option<Instant> = None;
        let status = loop {
            if let Some(status) = run.try_wait().expect("a child") {
                break status;
            }
            match asked {
                None if begun.elapsed() > long => {
                    asked = Some(Instant::now());
                    let kill = Command::new("kill")
                        .args([&format!("-{INTERRUPT}"), &run.id().to_string()])
                        .status();
                    assert!(kill.is_ok(), "kill runs");
                }
                Some(asked) if asked.elapsed() > PATIENCE => {
                    let _ = run.kill();
                    let _ = run.wait();
                    return Err("it does not end".into());
                }
                _ => std::thread::sleep(Duration::from_millis(2)),
            }
        };
        drop(line);
        let [printed, errors] = [printed, errors].map(|text| text.join().expect("read"));
        let was_ended = asked.is_some() && status.signal() == Some(INTERRUPT);
        match status.code().or(was_ended.then_some(1)) {
            Some(status) => Ok(Ended { status, printed, errors }),
            None => Err(format!("it ended with {status}: {errors}")),
        }
    }
}

/// Links all inputs into a folder; copies what is replaced, and the folder around it.
fn copy(from: &Path, to: &Path, replaced: &str) {
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name");
        let own = to.join(name);
        if Path::new(replaced).starts_with(name) && path.is_dir() {
            std::fs::create_dir(&own).expect("room");
            for inner in std::fs::read_dir(&path).expect("a folder") {
                let inner = inner.expect("an entry").path();
                std::fs::copy(&inner, own.join(inner.file_name().expect("a name"))).expect("room");
            }
        } else if Path::new(replaced) != Path::new(name) {
            std::os::unix::fs::symlink(&path, &own).expect("room");
        }
    }
}

/// An ELF file for ARM with one segment of 64 bytes at 0x10000000.
fn program() -> Vec<u8> {
    let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0\x28\0".to_vec();
    // Version, entry, program headers, section headers, flags; then sizes and counts, two in a word.
    for word in [1, 0, 52, 0, 0, 52 | 32 << 16, 1, 0] {
        file.extend(u32::to_le_bytes(word));
    }
    for word in [1, 84, 0x1000_0000, 0x1000_0000, 64, 64, 5, 4] {
        file.extend(u32::to_le_bytes(word));
    }
    file.extend(0..64);
    file
}
