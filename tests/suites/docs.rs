//! Checks that the documentation's references exist: links, headings, files, packages and their tests, examples and benches.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use vocc_tests::programs::{output, root};

/// Maximum line width in characters; tables, links and the output of `vocc accuracy` may be wider.
const WIDEST: usize = 140;
const WRITTEN_BY_VOCC: &str = "docs/accuracy.md";

/// The style guide, with its banned phrases.
const STYLE: &str = "docs/style.md";
/// Documents without banned phrases. The list only grows.
const PLAIN: [&str; 46] = [
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "README.md",
    "cli/README.md",
    "docs/README.md",
    "docs/SECURITY.md",
    "docs/accuracy.md",
    "docs/architecture.md",
    "docs/calibration.md",
    "docs/carrier.md",
    "docs/detectors.md",
    "docs/embedded-receiver.md",
    "docs/examples.md",
    "docs/flicker.md",
    "docs/glossary.md",
    "docs/hardware.md",
    "docs/hardware/bring-up.md",
    "docs/hardware/desk-kit.md",
    "docs/hardware/light-safety.md",
    "docs/hardware/receiver.md",
    "docs/hardware/reference.md",
    "docs/hardware/road-kit.md",
    "docs/inputs.md",
    "docs/live.md",
    "docs/numerics.md",
    "docs/optimum.md",
    "docs/physics.md",
    "docs/porting.md",
    "docs/pose.md",
    "docs/promises.md",
    "docs/receiver.md",
    "docs/releasing.md",
    "docs/reproduction.md",
    "docs/scale.md",
    "docs/serial.md",
    "docs/threats.md",
    "docs/tutorials/engineer.md",
    "docs/tutorials/researcher.md",
    "link/README.md",
    "page/README.md",
    "python/README.md",
    "rx-pipeline/README.md",
    "sim/README.md",
    "studies/README.md",
    "tests/README.md",
    "tx-firmware/README.md",
];

/// Commands that a reader would try in vain, and why.
const NO_COMMANDS: [(&str, &str); 1] = [("elf2uf2-rs convert", "elf2uf2-rs 2.2.0 takes the files at once")];

struct Document {
    /// Relative to the repository's root.
    path: PathBuf,
    text: String,
}

impl Document {
    fn events(&self) -> impl Iterator<Item = Event<'_>> {
        Parser::new_ext(&self.text, Options::ENABLE_TABLES)
    }

    /// Destinations of links and images, as written.
    fn destinations(&self) -> Vec<String> {
        let links = self.events().filter_map(|event| match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => Some(dest_url.into_string()),
            _ => None,
        });
        links.filter(|to| !to.contains("://") && !to.starts_with("mailto:")).collect()
    }

    /// The events, and whether each is inside a code block.
    fn events_by_place(&self) -> impl Iterator<Item = (Event<'_>, bool)> {
        self.events().scan(false, |inside, event| {
            match event {
                Event::Start(Tag::CodeBlock(_)) => *inside = true,
                Event::End(TagEnd::CodeBlock) => *inside = false,
                _ => {}
            }
            Some((event, *inside))
        })
    }

    /// Inline code, and lines of code blocks.
    fn code(&self) -> Vec<String> {
        let mut code = Vec::new();
        for (event, inside) in self.events_by_place() {
            match event {
                Event::Text(text) if inside => code.extend(text.lines().map(str::to_owned)),
                Event::Code(text) => code.push(text.into_string()),
                _ => {}
            }
        }
        code
    }

    /// All text outside code. The word 0 separates what no sentence spans.
    fn prose(&self) -> String {
        let mut prose = String::new();
        for (event, inside) in self.events_by_place() {
            match event {
                Event::Text(text) if !inside => prose += &text,
                Event::Code(_) => prose += " 0 ",
                Event::SoftBreak | Event::HardBreak => prose.push(' '),
                Event::End(TagEnd::Paragraph | TagEnd::Heading(_) | TagEnd::TableCell | TagEnd::Item) => prose += " 0 ",
                _ => {}
            }
        }
        prose
    }

    /// The anchors of its headings.
    fn anchors(&self) -> BTreeSet<String> {
        let mut anchors = BTreeSet::new();
        let mut heading: Option<String> = None;
        for event in self.events() {
            match event {
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => anchors.extend(heading.take().as_deref().map(anchor)),
                Event::Text(text) | Event::Code(text) => {
                    if let Some(heading) = &mut heading {
                        *heading += &text;
                    }
                }
                _ => {}
            }
        }
        anchors
    }
}

/// A heading's anchor as forges generate it: lower case, spaces to hyphens, no other punctuation.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter_map(|letter| match letter {
        ' ' => Some('-'),
        '-' | '_' => Some(letter),
        _ => letter.is_alphanumeric().then_some(letter),
    });
    kept.collect::<String>().to_lowercase()
}

/// All documents of the repository, ordered by path.
fn documents() -> Vec<Document> {
    let mut documents = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).expect("a folder") {
            let name = entry.expect("an entry").file_name();
            let path = folder.join(&name);
            let hidden = name.as_encoded_bytes().starts_with(b".");
            if root().join(&path).is_dir() {
                if !hidden && name != "target" && name != "node_modules" {
                    folders.push(path);
                }
            } else if path.extension() == Some(OsStr::new("md")) {
                let text = std::fs::read_to_string(root().join(&path)).expect("a document");
                documents.push(Document { path, text });
            }
        }
    }
    assert!(documents.len() > 10, "only {} documents", documents.len());
    documents.sort_by(|one, other| one.path.cmp(&other.path));
    documents
}

/// Cargo's targets of each package, by kind and name.
fn targets() -> BTreeMap<String, BTreeSet<(String, String)>> {
    let metadata = output(Command::new(env!("CARGO")).args(["metadata", "--no-deps", "--offline", "--format-version=1"]))
        .expect("Cargo describes the workspace");
    let metadata: serde_json::Value = serde_json::from_str(&metadata).expect("JSON");
    let list = |value: &serde_json::Value| value.as_array().cloned().unwrap_or_default();
    let word = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let packages = list(&metadata["packages"]).into_iter().map(|package| {
        let targets = list(&package["targets"]).into_iter();
        let named = targets.map(|target| (word(&target["kind"][0]), word(&target["name"])));
        (word(&package["name"]), named.collect())
    });
    packages.collect()
}

/// The word after `option` in a command.
fn after<'a>(command: &'a str, option: &str) -> Option<&'a str> {
    let mut words = command.split_whitespace();
    words.find(|word| *word == option)?;
    words.next()
}

#[test]
fn links_lead_to_files_and_headings_that_are_there() {
    let mut dead = Vec::new();
    for document in documents() {
        let folder = document.path.parent().expect("a folder");
        for to in document.destinations() {
            let (path, heading) = to.split_once('#').unwrap_or((&to, ""));
            let target = match path {
                "" => root().join(&document.path),
                path => root().join(folder).join(path),
            };
            let alive = target.exists()
                && (heading.is_empty() || {
                    let text = std::fs::read_to_string(&target).unwrap_or_default();
                    let target = Document { path: target, text };
                    target.anchors().contains(heading)
                });
            if !alive {
                dead.push(format!("{}: {to}", document.path.display()));
            }
        }
    }
    assert!(dead.is_empty(), "dead links:\n{}", dead.join("\n"));
}

#[test]
fn files_that_are_named_are_there() {
    let mut missing = Vec::new();
    for document in documents() {
        for code in document.code() {
            let is_path = code.contains('/') && !code.contains([' ', '*', '<', '$']);
            let first = code.split('/').next().unwrap_or_default();
            let is_ours = !first.is_empty() && !first.contains('.') && root().join(first).is_dir();
            if is_path && is_ours && first != "target" && !root().join(&code).exists() {
                missing.push(format!("{}: {code}", document.path.display()));
            }
        }
    }
    assert!(missing.is_empty(), "no such files:\n{}", missing.join("\n"));
}

#[test]
fn modules_that_are_named_are_there() {
    let mut missing = Vec::new();
    for document in documents() {
        for code in document.code() {
            let mut path = code.split("::");
            let (Some(library), Some(module)) = (path.next(), path.next()) else {
                continue;
            };
            let sources = root().join(library.replace('_', "-")).join("src");
            let is_ours = !library.is_empty() && !code.contains(' ') && sources.is_dir();
            let there = sources.join(module).is_dir() || sources.join(format!("{module}.rs")).exists();
            if is_ours && !there {
                missing.push(format!("{}: {code}", document.path.display()));
            }
        }
    }
    assert!(missing.is_empty(), "no such modules:\n{}", missing.join("\n"));
}

#[test]
fn commands_name_packages_tests_examples_and_benches_that_are_there() {
    let targets = targets();
    let mut wrong = Vec::new();
    let mut commands = 0;
    for document in documents() {
        for command in document.code() {
            let Some(package) = after(&command, "-p").filter(|_| command.contains("cargo ")) else {
                continue;
            };
            commands += 1;
            let known = targets.get(package).is_some_and(|targets| {
                ["test", "example", "bench"].iter().all(|kind| {
                    after(&command, &format!("--{kind}")).is_none_or(|name| targets.contains(&((*kind).to_owned(), name.to_owned())))
                })
            });
            if !known {
                wrong.push(format!("{}: {command}", document.path.display()));
            }
        }
    }
    assert!(commands > 20, "only {commands} commands were found");
    assert!(wrong.is_empty(), "no such package or target:\n{}", wrong.join("\n"));
}

#[test]
fn no_document_has_a_command_that_does_not_exist() {
    let mut found = Vec::new();
    for document in documents() {
        let words: Vec<&str> = document.text.split_whitespace().collect();
        let text = words.join(" ");
        let here = NO_COMMANDS.iter().filter(|(command, _)| text.contains(command));
        found.extend(here.map(|(command, why)| format!("{}: {command}: {why}", document.path.display())));
    }
    assert!(found.is_empty(), "commands that do not exist:\n{}", found.join("\n"));
}

#[test]
fn lines_of_prose_are_no_longer_than_140_characters() {
    let mut long = Vec::new();
    for document in documents() {
        if document.path == Path::new(WRITTEN_BY_VOCC) {
            continue;
        }
        let mut fenced = false;
        for (number, line) in document.text.lines().enumerate() {
            fenced ^= line.starts_with("```");
            let prose = !fenced && !line.starts_with('|') && !line.starts_with("    ");
            if prose && !line.contains("](") && line.chars().count() > WIDEST {
                long.push(format!("{}:{}", document.path.display(), number + 1));
            }
        }
    }
    assert!(long.is_empty(), "lines to break:\n{}", long.join("\n"));
}

/// A text's words in lower case, each between single spaces; the end of a sentence is a word of its own.
fn spaced(text: &str) -> String {
    let sentences = text.to_lowercase().replace(['.', ':', ';', '?'], " 0 ");
    let letters = sentences.replace(|letter: char| !letter.is_alphanumeric() && letter != '\'', " ");
    let words: Vec<&str> = letters.split_whitespace().collect();
    format!(" {} ", words.join(" "))
}

#[test]
fn plain_documents_have_none_of_the_banned_phrases() {
    let documents = documents();
    let document = |path: &str| {
        let found = documents.iter().find(|document| document.path == Path::new(path));
        found.unwrap_or_else(|| panic!("no document {path}"))
    };
    let (_, list) = document(STYLE).text.split_once("## Banned phrases").expect("the heading");
    let banned = list
        .lines()
        .filter(|line| line.starts_with("- "))
        .flat_map(|line| line.split('`').skip(1).step_by(2));
    let banned: Vec<String> = banned.map(spaced).collect();
    assert!(banned.len() > 20, "only {} phrases were found", banned.len());
    let mut found = Vec::new();
    for path in PLAIN {
        let prose = spaced(&document(path).prose());
        let here = banned.iter().filter(|phrase| prose.contains(phrase.as_str()));
        found.extend(here.map(|phrase| format!("{path}:{phrase}")));
    }
    assert!(found.is_empty(), "phrases that {STYLE} bans:\n{}", found.join("\n"));
}

/// The list of numbers in the documentation, with the commands that print them.
const NUMBERS: &str = "tests/numbers.toml";
/// Pages that state results, besides those of `docs/hardware`. Each of their commands is checked by `tests/tools/numbers`, or listed with
/// the reason why not.
const RESULTS: [&str; 13] = [
    "docs/accuracy.md",
    "docs/calibration.md",
    "docs/carrier.md",
    "docs/detectors.md",
    "docs/flicker.md",
    "docs/live.md",
    "docs/numerics.md",
    "docs/optimum.md",
    "docs/physics.md",
    "docs/pose.md",
    "docs/receiver.md",
    "docs/reproduction.md",
    "docs/scale.md",
];

/// A page, and a command on it.
type Listed = (String, String);

/// The commands in a page's code. Except tests of Cargo, which run anyway, what needs a board (`vocc device`), and mere names, such as
/// `vocc scene day`.
fn commands(document: &Document) -> impl Iterator<Item = String> {
    let lines = document.code().join("\n").replace("\\\n", " ");
    let lines: Vec<String> = lines.lines().map(str::to_owned).collect();
    let commands = lines.into_iter().flat_map(|line| {
        let command = line.split(" #").next().unwrap_or_default();
        let parts = command.split("; ").flat_map(|part| part.split(" && ")).map(|part| {
            let words: Vec<&str> = part.split_whitespace().skip_while(|word| ["do", "time"].contains(word)).collect();
            words.join(" ")
        });
        parts.collect::<Vec<String>>()
    });
    commands.filter(|command| {
        let has_arguments = command.split(' ').nth(3).is_some();
        let runs = ["vocc ", "cargo run", "cargo bench"]
            .iter()
            .any(|program| command.starts_with(program));
        runs && has_arguments && !command.starts_with("vocc device ") || command.starts_with("tests/tools/")
    })
}

/// The commands that the list of numbers has, with those that it says it does not check.
fn listed() -> BTreeSet<Listed> {
    let list = std::fs::read_to_string(root().join(NUMBERS)).expect("the list");
    let list: toml::Table = list.parse().expect("TOML");
    let entries = |kind: &str| list[kind].as_array().expect("an array").clone();
    let checked = entries("number").into_iter().filter_map(|entry| {
        let command = entry.get("command")?.as_str()?.to_owned();
        Some((entry["page"].as_str()?.to_owned(), command))
    });
    let unchecked = entries("unchecked").into_iter().flat_map(|entry| {
        assert!(entry["why"].is_str(), "no reason: {entry}");
        let page = entry["page"].as_str().expect("a page").to_owned();
        let commands = entry["commands"].as_array().expect("commands").clone();
        commands
            .into_iter()
            .map(move |command| (page.clone(), command.as_str().expect("a command").to_owned()))
    });
    checked.chain(unchecked).collect()
}

#[test]
fn commands_of_pages_with_results_are_checked_or_it_is_said_why_not() {
    let listed = listed();
    let mut there = BTreeSet::new();
    for document in documents() {
        let page = document.path.display().to_string();
        let has_results = RESULTS.contains(&page.as_str()) || page.starts_with("docs/hardware/");
        let is_listed = |command: &String| listed.contains(&(page.clone(), command.clone()));
        there.extend(
            commands(&document)
                .filter(|command| has_results || is_listed(command))
                .map(|command| (page.clone(), command)),
        );
    }
    let told = |list: Vec<&Listed>| {
        list.iter()
            .map(|(page, command)| format!("{page}: {command}"))
            .collect::<Vec<_>>()
            .join("\n")
    };
    let missing = told(there.difference(&listed).collect());
    assert!(missing.is_empty(), "add these to {NUMBERS}, as numbers or as unchecked:\n{missing}");
    let gone = told(listed.difference(&there).collect());
    assert!(gone.is_empty(), "{NUMBERS} lists commands that the pages do not have:\n{gone}");
}
