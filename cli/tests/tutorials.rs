//! Executes the tutorials literally: each block of commands runs in the folder that the earlier blocks have left, and the block of text
//! after it must be printed.
#![cfg(unix)]

mod common;

use std::path::Path;
use std::process::{Command, Stdio};

use common::folder;

/// Printed after each step.
const END: &str = "--- the end of a step ---";

/// Commands with their expected output.
#[derive(Debug, Default, PartialEq)]
struct Step {
    commands: String,
    printed: Vec<String>,
}

/// The steps of a tutorial: its ```sh blocks, each with the ```text block before the next one, if any.
fn steps(tutorial: &str) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let mut block = None;
    for line in tutorial.lines() {
        match (block, line.strip_prefix("```")) {
            (None, Some(kind)) => {
                block = Some(kind);
                if kind == "sh" {
                    steps.push(Step::default());
                }
            }
            (Some(_), Some(_)) => block = None,
            (Some(kind), None) => {
                let step = steps.last_mut().expect("commands come before what they print");
                match kind {
                    "sh" => step.commands += &format!("{line}\n"),
                    "text" => step.printed.push(line.to_owned()),
                    other => panic!("a block of {other:?} is neither sh nor text"),
                }
            }
            (None, None) => {}
        }
    }
    steps
}

/// An expected line that is missing in the output. Lines may come in any order, and as a part of a longer line.
fn missing<'a>(printed: &str, wanted: &'a [String]) -> Option<&'a str> {
    let mut lines: Vec<&str> = printed.lines().collect();
    for wanted in wanted {
        match lines.iter().position(|line| line.contains(wanted.as_str())) {
            Some(at) => drop(lines.remove(at)),
            None => return Some(wanted),
        }
    }
    None
}

/// Runs all steps in one shell, as a reader would, with `vocc` in its path. Returns the output of each, and the standard error of all. Ends
/// everything that still runs.
fn sh(place: &Path, steps: &[Step]) -> (Vec<String>, String) {
    let vocc = Path::new(env!("CARGO_BIN_EXE_vocc"));
    let beside = vocc.parent().expect("a folder").display();
    let path = std::env::var("PATH").unwrap_or_default();
    let commands = steps.iter().map(|step| format!("{}\necho \"{END}\"\n", step.commands));
    let ended = "trap 'jobs -p | xargs -r kill' EXIT\n".to_owned();
    let [said, told] = ["said.txt", "told.txt"].map(|name| place.with_file_name(format!("{}-{name}", name_of(place))));
    let create = |file: &Path| std::fs::File::create(file).expect("a file");
    let status = Command::new("bash")
        .args(["-euo", "pipefail", "-c", &(ended + &commands.collect::<String>())])
        .current_dir(place)
        .env("PATH", format!("{beside}:{path}"))
        .stdin(Stdio::null())
        .stdout(create(&said))
        .stderr(create(&told))
        .status()
        .expect("bash runs");
    let [said, told] = [said, told].map(|file| std::fs::read_to_string(file).expect("text"));
    assert!(status.success(), "{said}{told}");
    let parts = said.split(END).map(String::from);
    (parts.collect(), told)
}

fn name_of(place: &Path) -> String {
    let name = place.file_name().expect("a name");
    name.to_string_lossy().into_owned()
}

fn does(tutorial: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../docs/tutorials/{tutorial}.md"));
    let steps = steps(&std::fs::read_to_string(path).expect("a tutorial"));
    assert!(steps.len() > 2, "{steps:?}");
    let place = folder(&format!("tutorial-{tutorial}"));
    let (said, told) = sh(&place, &steps);
    assert_eq!(said.len(), steps.len() + 1);
    for (Step { commands, printed }, said) in steps.iter().zip(&said) {
        let missing = missing(said, printed);
        assert_eq!(missing, None, "{commands}{said}{told}");
    }
}

#[test]
fn the_researcher_s_is_true() {
    does("researcher");
}

#[test]
fn the_engineer_s_is_true() {
    does("engineer");
}

#[test]
fn what_is_not_printed_is_noticed() {
    let steps = steps("a\n```sh\nvocc\n```\nb\n```text\none\none\n```\n```sh\nls\n```\n");
    assert_eq!(steps.len(), 2);
    assert_eq!(steps[0].commands, "vocc\n");
    assert_eq!(missing("no one\n", &steps[0].printed), Some("one"));
    assert_eq!(missing("one two\nno one\n", &steps[0].printed), None);
    assert_eq!(steps[1].printed.len(), 0);
}
