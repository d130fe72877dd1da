//! What `vocc` reads, and the command that reads it.

/// A kind of input.
#[derive(Debug)]
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// Its file among the workshop's; none of what comes over a serial line.
    pub file: &'static str,
    /// The command; `{}` is the file, `%` the port of a transmitter.
    pub command: &'static str,
    /// Whether the file is standard input.
    pub is_input: bool,
    /// Exit status if it is whole.
    pub status: i32,
    /// A word of its output.
    pub word: &'static str,
}

const fn kind(name: &'static str, file: &'static str, command: &'static str, word: &'static str) -> Kind {
    Kind {
        name,
        file,
        command,
        is_input: false,
        status: 0,
        word,
    }
}

const fn input(name: &'static str, file: &'static str, command: &'static str, word: &'static str) -> Kind {
    Kind {
        is_input: true,
        ..kind(name, file, command, word)
    }
}

const fn answered_no(kind: Kind) -> Kind {
    Kind { status: 1, ..kind }
}

/// Reads a picture by a camera's file.
const BY_CAMERA: &str = "decode grey.png --camera {} --interval 1 --led-diameter 0.03";

/// All kinds.
pub const KINDS: &[Kind] = &[
    kind("PNG", "grey.png", "decode {}", "confidence"),
    kind("PNG of 16 bits", "deep.png", "decode {}", "confidence"),
    kind("PNG of colours", "colour.png", "decode {} --channel red", "confidence"),
    kind("PNG mosaic", "grey.png", "decode {} --bayer RGGB", "confidence"),
    kind("JPEG", "grey.jpg", "decode {}", "confidence"),
    kind("PGM", "grey.pgm", "decode {}", "confidence"),
    kind("PGM of 12 bits", "deep.pgm", "decode {} --depth 12", "confidence"),
    answered_no(kind("PGM in text", "text.pgm", "decode {}", "no candidate")),
    kind(
        "card of a calibration",
        "grey.png",
        "decode {} --corners 125,85,195,85,195,155,125,155",
        "confidence",
    ),
    answered_no(kind("y4m", "film.y4m", "receive {} --bits", "frame 3:")),
    answered_no(input("deep y4m in a pipe", "deep.y4m", "receive - --bits", "frame 3:")),
    answered_no(input("raw stream", "film.raw", "receive - --raw 320x240 --bits", "frame 3:")),
    answered_no(kind("ffmpeg's log", "log", "receive film.mp4 --bits", "frame 3:")),
    answered_no(kind("time stamps", "frames/timestamps.csv", "receive frames --bits", "frame 3:")),
    kind("scene", "scene.toml", "plan {}", "noise"),
    kind("background", "grey.png", "plan day --set ambient.background_image={}", "effect"),
    kind("plan of a sweep", "plan.toml", "sweep {} --out swept --threads 1", "60"),
    kind(
        "part of a sweep",
        "half/shard-000000-of-000002.json",
        "sweep plan.toml --out half --shard 0/2 --resume",
        "",
    ),
    kind(
        "evaluation",
        "shard-0.json",
        "evaluate --frames 512 --shard 0/2 --resume --out {}",
        "BER",
    ),
    kind("shard", "shard-0.json", "merge {} shard-1.json --out merged.json", "BER"),
    kind("table", "table.toml", "table check {}", ""),
    kind(
        "table of a scene",
        "table.toml",
        "plan --set link.l2a=table --set link.table={}",
        "effect",
    ),
    answered_no(kind("table to compare", "table.toml", "table diff reach.toml {}", "")),
    kind("table of reaches", "reach.toml", "table regret {} --in {} --out robust.toml", ""),
    kind("OpenCV's calibration", "opencv.yml", BY_CAMERA, "confidence"),
    kind("calibration of ROS", "ros.yaml", BY_CAMERA, "confidence"),
    kind("camera_info", "camera_info.yaml", BY_CAMERA, "confidence"),
    kind("camera", "camera.toml", BY_CAMERA, "confidence"),
    kind("key", "key.toml", "transmit --message hi --sign {} --counter 9", ""),
    kind("key to show", "key.toml", "keys show {}", "public"),
    kind("keys to trust", "keys.toml", "receive signed --trust {}", "hi"),
    kind("counters", "counters.toml", "receive signed --trust keys.toml --counters {}", "hi"),
    kind("message", "message", "transmit --message-file {}", ""),
    input("orders to a board", "orders", "device simulate --symbols shown", "/dev/"),
    kind("flash", "flash", "device simulate --flash {}", "/dev/"),
    kind(
        "calibration of a panel",
        "panel.toml",
        "device calibration {} --port %",
        "luminance",
    ),
    kind("answers of a board", "", "device status --port % --timeout 0.05", "duty"),
    kind("table in a board", "", "table pull pulled.toml --port % --timeout 0.05", ""),
    kind("program of a board", "program.elf", "device hello --no-board --image {}", "SHA-256"),
];
