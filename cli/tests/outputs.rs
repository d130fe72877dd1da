//! Files are written whole or not at all, wherever the disk is full.
#![cfg(target_os = "linux")]

mod common;

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use common::{folder, refused, says, text, vocc};

/// The program with a limit on the size of files, in KiB: a write beyond it fails as on a full disk.
fn vocc_on_full_disk(folder: &Path, kib: u32, arguments: &str) -> Output {
    let vocc = env!("CARGO_BIN_EXE_vocc");
    Command::new("bash")
        .current_dir(folder)
        .args(["-c", &format!("trap '' XFSZ; ulimit -f {kib}; exec {vocc} {arguments}")])
        .output()
        .expect("bash runs")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into())
        .collect();
    names.sort();
    names
}

#[test]
fn a_picture_that_has_no_room_leaves_the_old_one() {
    let place = folder("full-render");
    let render = "render --crop --set pose.distance_m=20 --out c.png --linear c.npy";
    let old = vocc_on_full_disk(&place, 1024, render);
    says(&old, 0, &[]);
    let read = |name: &str| std::fs::read(place.join(name)).expect("there");
    let before = [read("c.png"), read("c.npy")];
    let kib = before[0].len() as u32 / 1024;
    assert!(kib > 0 && !before[0].len().is_multiple_of(1024), "{} bytes", before[0].len());
    // The picture's last bytes, and the whole matrix.
    for (kib, arguments) in [
        (kib, "render --crop --set pose.distance_m=20 --out c.png --seed 2"),
        (kib, &format!("{render} --seed 2")),
        (0, "render --crop --out c.png"),
    ] {
        let full = vocc_on_full_disk(&place, kib, arguments);
        says(&full, 2, &["cannot write c."]);
        assert!(text(&full.stdout).is_empty(), "{full:?}");
        assert_eq!([read("c.png"), read("c.npy")], before, "{arguments}");
        assert_eq!(names(&place), ["c.npy", "c.png"]);
    }
}

#[test]
fn frames_and_panels_that_have_no_room_are_not_half_there() {
    let place = folder("full-frames");
    let link = vocc_on_full_disk(&place, 4, "link --frames 1 --save frames");
    says(&link, 2, &["cannot write frames/frame-000000.png"]);
    assert!(names(&place.join("frames")).is_empty());
    // The results are still reported.
    assert!(text(&link.stdout).contains("bit errors"), "{link:?}");
    let film = vocc_on_full_disk(
        &place,
        4096,
        "link day --message hi --level fast --save film --set camera.width_px=320 --set camera.height_px=240",
    );
    says(&film, 0, &[]);
    let seen = vocc_on_full_disk(&place, 1, "receive film --symbol-rate 90 --show seen");
    says(&seen, 2, &["cannot write seen/frame-", "continuing without pictures"]);
    assert!(text(&seen.stdout).contains("hi"), "{seen:?}");
    assert!(names(&place.join("seen")).is_empty());
    let picture = vocc_on_full_disk(&place, 1, "decode film/frame-000000.png --show seen");
    says(&picture, 2, &["cannot write seen/frame-000000-panel.png"]);
    assert!(text(&picture.stdout).contains("confidence"), "{picture:?}");
    assert!(names(&place.join("seen")).is_empty());
    let panels = vocc_on_full_disk(&place, 4, "transmit --message A --count 1000 --symbols panels.txt");
    says(&panels, 2, &["cannot write panels.txt"]);
    assert_eq!(names(&place), ["film", "frames", "seen"]);
}

#[test]
fn a_full_device_is_no_place_for_anything() {
    let place = folder("full-device");
    says(
        &vocc(&["render", "--crop", "--out", "/dev/full"]),
        2,
        &["/dev/full", "No space left"],
    );
    let both = ["render", "--crop", "--out", "/dev/null", "--linear", "/dev/full"];
    says(&vocc(&both), 2, &["/dev/full", "No space left"]);
    let panels = ["transmit", "--message", "A", "--symbols", "/dev/full"];
    says(&vocc(&panels), 2, &["/dev/full", "No space left"]);
    let frames = place.join("frames");
    let frames = common::name(&frames);
    says(&vocc(&["link", "--frames", "3", "--save", frames]), 1, &[]);
    let camera = ["receive", frames, "--save-camera", "/dev/full"];
    says(&vocc(&camera), 2, &["/dev/full", "No space left"]);
}

#[test]
fn pipes_and_standard_output_are_written_to() {
    let png = vocc(&["render", "--crop", "--out", "/dev/stdout"]);
    says(&png, 0, &[]);
    assert!(png.stdout.starts_with(b"\x89PNG"));
    let place = folder("pipe");
    let script = format!(
        "mkfifo pipe; cat pipe > panels & {} transmit --message A --symbols pipe && wait && test -p pipe",
        env!("CARGO_BIN_EXE_vocc")
    );
    let piped = Command::new("bash")
        .current_dir(&place)
        .args(["-c", &script])
        .output()
        .expect("bash runs");
    assert!(piped.status.success(), "{piped:?}");
    let panels = std::fs::read_to_string(place.join("panels")).expect("there");
    assert_eq!(panels, text(&vocc(&["transmit", "--message", "A"]).stdout));
}

/// Runs a script with bash in a folder, with `vocc` as the program.
fn bash(place: &Path, script: &str) -> Output {
    let vocc = env!("CARGO_BIN_EXE_vocc");
    Command::new("bash")
        .current_dir(place)
        .args(["-c", &format!("vocc() {{ {vocc} \"$@\"; }}; {script}")])
        .output()
        .expect("bash runs")
}

#[test]
fn nothing_that_is_read_is_overwritten() {
    let place = folder("overwriting");
    let write = |name: &str, text: &str| std::fs::write(place.join(name), text).expect("written");
    write("scene.toml", "[pose]\ndistance_m = 40\n");
    write("message", "bend ahead");
    write("camera.toml", "blur_sigma_px = 1.5\n");
    write("user.csv", "mine\n");
    write("user.svg", "mine\n");
    write("old.toml", "mine = true\n");
    write("protected.png", "mine\n");
    std::fs::create_dir(place.join("photographs")).expect("a folder");
    write("photographs/mine.JPG", "mine\n");
    let made = bash(
        &place,
        "vocc link --frames 2 --save film > /dev/null; chmod a-w protected.png; ln -s nowhere dangling.png
         vocc evaluate --frames 512 --out a.json --shard 0/2 > /dev/null
         vocc evaluate --frames 512 --out b.json --shard 1/2 > /dev/null; mkdir S; mv a.json b.json S",
    );
    says(&made, 0, &[]);
    let before = bash(&place, "find . -type f | sort | xargs md5sum").stdout;
    for (arguments, words) in [
        ("render scene.toml --crop --out scene.toml", "scene.toml is an input"),
        ("render scene.toml --crop --out x.png --linear ./scene.toml", "is an input"),
        ("render --crop --out x.png --linear x.png", "written twice"),
        ("render --crop --out dangling.png", "nowhere"),
        ("render --crop --out protected.png", "write-protected"),
        ("render --crop --out film", "folder"),
        ("render --crop --out none/x.png", "none/x.png"),
        ("transmit --message-file message --symbols message", "is an input"),
        ("evaluate scene.toml --out scene.toml --resume", "is an input"),
        ("evaluate --out user.json --frames 1000000000", "user.csv"),
        ("evaluate --out none/x.json --frames 1000000000", "none/x.json"),
        ("evaluate --out old.toml --frames 1000000000", "exists"),
        ("optimize --out user.toml", "user.svg"),
        ("merge S/a.json S/b.json --out S/a.json", "is an input"),
        ("merge S/a.json S/b.json --out old.toml", "does not hold the sum of these"),
        ("merge S/a.json S/b.json --out user.json", "user.csv"),
        ("receive film --camera camera.toml --save-camera camera.toml", "is an input"),
        ("receive film --save-camera film/frame-000001.png", "is an input"),
        ("receive film --save-camera none/camera.toml", "none/camera.toml"),
        ("receive film --show ./film", "holds frames"),
        ("receive film/frame-000000.png --show ./film", "holds frames"),
        ("receive protected.png --show .", "holds frames"),
        ("receive scene.toml --show .", "neither a picture"),
        ("decode film/frame-000000.png --show ./film", "holds frames"),
        ("decode film/frame-000000.png S/frame-000000.png --show seen", "written twice"),
        ("link --frames 2 --save film", "already holds frames"),
        ("link --frames 2 --save photographs", "such as mine.JPG"),
        ("table pull old.toml --port /dev/none", "holds more"),
        ("sweep --slurm old.toml plan.toml", "plan.toml"),
    ] {
        let output = bash(&place, &format!("vocc {arguments}"));
        says(&output, 2, &[words]);
        let after = bash(&place, "find . -type f | sort | xargs md5sum").stdout;
        assert_eq!(text(&after), text(&before), "{arguments}");
    }
}

/// A run that has started to write a file.
fn begun(arguments: &[&str], file: &Path) -> Child {
    let mut run = common::command(arguments);
    let mut run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("vocc runs");
    while !file.exists() {
        assert!(run.try_wait().expect("known").is_none(), "it has ended");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    run
}

#[test]
fn two_runs_do_not_share_a_place() {
    let place = folder("two-runs").join("kept.json");
    let out = common::name(&place);
    let mut first = begun(&["evaluate", "--frames", "1000000000", "--threads", "1", "--out", out], &place);
    refused(&["evaluate", "--frames", "512", "--out", out], &["exists"]);
    first.kill().expect("it runs");
    first.wait().expect("it ends");
    refused(&["evaluate", "--frames", "512", "--out", out, "--resume"], &["frames differ"]);
}

#[test]
fn two_runs_do_not_share_a_folder() {
    let place = folder("two-figures");
    let arguments = ["figures", "--quick", "--threads", "1", "--out", common::name(&place)];
    let mut first = begun(&arguments, &place.join("findings.json"));
    refused(&arguments, &["another run uses"]);
    first.kill().expect("it runs");
    first.wait().expect("it ends");
}

#[test]
fn a_sum_may_be_made_again() {
    let place = folder("again");
    let merged = bash(
        &place,
        "for k in 0 1; do vocc evaluate --frames 512 --out $k.json --shard $k/2 > /dev/null; done
         vocc merge 0.json 1.json --out sum.json > /dev/null && vocc merge 0.json 1.json --out sum.json > /dev/null",
    );
    says(&merged, 0, &[]);
}

#[test]
fn help_that_cannot_be_printed_is_told() {
    let place = folder("help");
    for arguments in ["--help", "--version", "sweep --help", "help render", "plan", "scene"] {
        let full = bash(&place, &format!("vocc {arguments} > /dev/full"));
        says(&full, 2, &["No space left"]);
        let closed = bash(
            &place,
            &format!("rm -f pipe; mkfifo pipe; exec 3<>pipe 4>pipe 3<&-; vocc {arguments} >&4"),
        );
        says(&closed, 0, &[]);
    }
}

#[test]
fn nobody_need_listen_to_what_is_told() {
    let place = folder("deaf");
    for (arguments, status) in [
        ("plan none.toml", 2),
        ("no-such-command", 2),
        ("decode none.png", 2),
        ("receive none.png", 2),
        ("evaluate --frames 512 --out none/x.json", 2),
        ("evaluate --frames 512", 0),
    ] {
        for nobody in ["2> /dev/full", "2>&-"] {
            let output = bash(&place, &format!("vocc {arguments} {nobody} > /dev/null"));
            assert_eq!(output.status.code(), Some(status), "{arguments} {nobody}");
        }
    }
    refused(&["plan", "none.toml"], &["none.toml"]);
}
