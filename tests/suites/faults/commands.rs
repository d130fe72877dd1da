//! Every command of the program, with work short enough to be disturbed often.

/// A command line.
///
/// In its arguments `@name` is an output file, `@name/` an output folder, `<name` an input file, and `%port` a serial port without a
/// device; `%board` is one with a simulated transmitter.
#[derive(Clone, Copy, Debug)]
pub struct Work {
    /// The command's name in `--help`, for example `table show`.
    pub command: &'static str,
    /// Its arguments.
    pub arguments: &'static str,
    /// File for standard input.
    pub input: Option<&'static str>,
    /// How to repeat the command.
    pub again: Again,
    /// Whether repeated runs write the same bytes; measured times differ.
    pub repeats: bool,
    /// Relative frequency; slow commands have a low one.
    pub turns: u32,
    /// Whether it is too slow to finish in the gate, where it is only disturbed and not resumed.
    pub is_slow: bool,
}

/// What a repeated run does with existing output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Again {
    /// Overwrites it.
    Replaces,
    /// Resumes with `--resume`.
    Resumes,
    /// Refuses to overwrite; the test deletes the files first.
    Clears,
}

const fn work(command: &'static str, arguments: &'static str) -> Work {
    Work {
        command,
        arguments,
        input: None,
        again: Again::Replaces,
        repeats: true,
        turns: 4,
        is_slow: false,
    }
}

const fn long(command: &'static str, arguments: &'static str) -> Work {
    Work {
        again: Again::Resumes,
        turns: 6,
        ..work(command, arguments)
    }
}

/// All commands; the empty one is the program without a command.
pub const WORKS: &[Work] = &[
    work("", ""),
    Work {
        again: Again::Clears,
        ..work(
            "link",
            "day --level fast --message hi --frames 12 --save @saved/ --set camera.width_px=320 --set \
             camera.height_px=240",
        )
    },
    work("render", "--crop --out @c.png --linear @c.npy"),
    work("render", "--out @whole.png"),
    Work {
        again: Again::Clears,
        ..work("frames", "<scene.toml --count 300 --features --detector kmeans --out @set.npz")
    },
    Work {
        again: Again::Clears,
        ..work("frames", "<scene.toml --count 300 --out @arrays/")
    },
    Work {
        again: Again::Clears,
        ..work("frames", "<scene.toml --count 12 --format png --out @pictures/")
    },
    work("plan", "<scene.toml"),
    Work {
        turns: 1,
        ..work(
            "plan",
            "--camera <scene.toml --runs 1 --bytes 4 --set camera.width_px=320 --set camera.height_px=240",
        )
    },
    long("evaluate", "--frames 4096 --out @e.json"),
    Work {
        turns: 1,
        ..long(
            "evaluate",
            "--frames 512 --rare-events --set effects.noise=on --set ambient.illuminance_lx=50 --out @r.json",
        )
    },
    Work {
        turns: 2,
        is_slow: true,
        ..long("figures", "--quick --frames 1000 --out @figures/")
    },
    long("sweep", "<plan.toml --out @sweep/"),
    long("sweep", "<plan.toml --out @shards/ --shard 0/2"),
    Work {
        turns: 1,
        repeats: false,
        ..long("accuracy", "--quick --part effects --out @accuracy/")
    },
    Work {
        again: Again::Clears,
        ..work("merge", "<shard-0.json <shard-1.json --out @merged.json")
    },
    long("optimize", "--frames 64 --intervals 1,2 --distances 50 -o @best.toml"),
    work("table show", "<table.toml"),
    work("table check", "<table.toml"),
    work("table diff", "<table.toml <table.toml"),
    work("table regret", "<reach.toml --in <reach.toml --out @robust.toml"),
    work("table push", "<table.toml --port %port --timeout 0.05"),
    work("table pull", "@pulled.toml --port %port --timeout 0.05"),
    work("table verify", "<table.toml --port %port --timeout 0.05"),
    work("transmit", "--message hi --symbols @symbols.txt"),
    work("transmit", "--message-file <message.txt"),
    work("decode", "<frame.png"),
    work(
        "receive",
        "frames --symbol-rate 90 --show @shown/ --save-camera @camera.toml --mcap @received.mcap --view",
    ),
    Work {
        input: Some("film.raw"),
        ..work("receive", "- --raw 320x240 --symbol-rate 90 --bits")
    },
    work("device list", ""),
    work("device hello", "--port %port --timeout 0.05"),
    work("device status", "--port %port --timeout 0.05"),
    work("device watch", "--count 1 --port %port --timeout 0.05"),
    work("device snapshot", "--port %port --timeout 0.05 --out @snapshot.png"),
    work("device calibration", "--port %port --timeout 0.05"),
    Work {
        again: Again::Clears,
        turns: 2,
        ..work("device calibration", "--template @calibration.toml")
    },
    work("device rate", "27 --port %port --timeout 0.05"),
    work("device key", "--key <key.toml --port %port --timeout 0.05"),
    work("device lock", "--new-pin-file <key.toml --port %port --timeout 0.05"),
    work("device unlock", "--port %port --timeout 0.05"),
    work("device send", "--message-file <message.txt --port %port --timeout 0.05"),
    work("device test", "--port %port --timeout 0.05"),
    work("device test", "--frames frames"),
    Work {
        again: Again::Clears,
        ..work(
            "device calibrate",
            "--frames duties --corners 47,47,353,47,353,353,47,353 --card 0,0,30,400 --encoding 2.2 --illuminance-lx \
             10000 --out @panel.toml",
        )
    },
    Work {
        input: Some("orders.txt"),
        repeats: false,
        ..work("device simulate", "--symbols @shown.txt")
    },
    Work {
        again: Again::Clears,
        repeats: false,
        ..work("keys new", "@key.toml")
    },
    work("keys show", "<key.toml"),
    work("scene", "night"),
];

/// Commands that fail or answer no; their status does not depend on a reader.
pub const REFUSING: &[Work] = &[
    work("table diff", "<table.toml <reach.toml"),
    work("decode", "<grey.pgm"),
    work("decode", "<grey.pgm <broken.png <frame.png"),
    work("receive", "<grey.pgm <broken.png --bits"),
    work("link", "--frames 3"),
    work("sweep", "--status half"),
];

/// Options that write files beside what the reader sees.
pub const ASIDE: &[Work] = &[
    work("table show", "<table.toml --plot @plot"),
    work("transmit", "--message hi --flicker --plot @flicker"),
    Work {
        again: Again::Clears,
        ..work("receive", "frames --symbol-rate 90 --out @bytes")
    },
];

/// Commands that a transmitter answers.
pub const ANSWERED: &[Work] = &[
    work("table pull", "@pulled.toml --port %board"),
    work("table push", "<table.toml --port %board"),
    work("table verify", "<table.toml --port %board"),
    work("device hello", "--port %board"),
    work("device status", "--port %board"),
    work("device watch", "--count 3 --interval 0.05 --port %board"),
    work("device calibration", "--port %board"),
    work("device rate", "27 --port %board"),
    work("device send", "--message-file <message.txt --port %board"),
];

/// Every command with the largest arguments that extend its run time.
pub const LARGEST: &[Work] = &[
    work("", "--set camera.width_px=8192 --set camera.height_px=8192"),
    work("link", "day --message-file <long.txt --frames 18446744073709551615"),
    work(
        "link",
        "day --message-file <long.txt --frames 18446744073709551615 --save @saved/ --set camera.width_px=8192 --set \
             camera.height_px=8192",
    ),
    work(
        "render",
        "--level reference --out @widest.png --linear @widest.npy --set camera.width_px=8192 --set \
             camera.height_px=8192",
    ),
    work("frames", "--count 10000000 --features --detector ml --out @frames/"),
    work("frames", "--count 10000000 --format png --out @pictures/"),
    work("frames", "--count 1000000 --out @most.npz"),
    work("plan", "--camera <scene.toml --runs 10000 --bytes 1024"),
    work("evaluate", "--frames 1000000000000 --detector ml --out @most.json"),
    work("figures", "--frames 100000000 --out @figures/"),
    work("sweep", "<longest.toml --out @sweep/"),
    work("accuracy", "--out @accuracy/"),
    work("merge", "<shard-0.json <shard-1.json --out @merged.json"),
    work("optimize", "--frames 100000000 --detector ml --tolerance 0 -o @best.toml"),
    work("table show", "<reach.toml --plot @plot"),
    work("table check", "<reach.toml"),
    work("table diff", "<reach.toml <reach.toml"),
    work("table regret", "<reach.toml --in <reach.toml --out @robust.toml"),
    work("table push", "<table.toml --port %port --timeout 60"),
    work("table pull", "@pulled.toml --port %port --timeout 60"),
    work("table verify", "<table.toml --port %port --timeout 60"),
    work("transmit", "--message-file <long.txt --count 16777216 --symbols @symbols.txt"),
    work("transmit", "--message-file <long.txt --raw --count 16777216"),
    work("transmit", "--message-file <long.txt --flicker --plot @flicker"),
    work("decode", "<widest.png"),
    Work {
        input: Some("/dev/zero"),
        ..work("receive", "- --raw 8192x8192 --panels 4 --mcap @received.mcap --out @bytes")
    },
    work("receive", "frames frames frames frames --show @shown/ --bits --json"),
    Work {
        input: Some("/dev/zero"),
        ..work(
            "receive",
            "--live - --raw 8192x8192 --panels 4 --mcap @received.mcap --show @shown/ --bits",
        )
    },
    Work {
        input: Some("/dev/zero"),
        ..work(
            "receive",
            "--live - --raw 640x480 --view --foxglove=0 --mcap @received.mcap --max-size 10M",
        )
    },
    Work {
        input: Some("/dev/zero"),
        ..work("receive", "- --raw 8192x8192 --view --foxglove=0 --json")
    },
    work("device list", ""),
    work("device hello", "--port %port --timeout 60"),
    work("device status", "--port %port --timeout 60"),
    work("device watch", "--interval 3600 --port %port --timeout 60"),
    work("device snapshot", "--port %port --timeout 60 --out @snapshot.png"),
    work("device calibration", "--port %port --timeout 60"),
    work("device rate", "27 --port %port --timeout 60"),
    work("device key", "--key <key.toml --port %port --timeout 60"),
    work("device lock", "--new-pin-file <key.toml --port %port --timeout 60"),
    work("device unlock", "--port %port --timeout 60"),
    work("device send", "--message-file <long.txt --port %port --timeout 60"),
    work("device test", "--port %port --timeout 60"),
    work("device calibrate", "--frames duties --illuminance-lx 10000 --out @panel.toml"),
    Work {
        input: Some("/dev/zero"),
        ..work("device simulate", "--symbols @shown.txt --film /dev/null")
    },
    Work {
        again: Again::Clears,
        repeats: false,
        ..work("keys new", "@key.toml")
    },
    work("keys show", "<key.toml"),
    work("scene", "night"),
];

/// The commands listed in a help text.
pub fn listed(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    lines
        .take_while(|line| !line.is_empty())
        // Descriptions may continue on the next line, further indented.
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(String::from)
        .collect()
}
