//! `vocc keys`, `vocc transmit --sign`, `vocc link --sign` and `vocc receive --trust`.

mod common;

use std::path::Path;

use common::{json, json_lines, paths, refused, says, text, vocc, write_key};
use mcap::MessageStream;

fn film(message: &str, into: &str, more: &[&str]) -> serde_json::Value {
    let link = ["link", "day", "--message", message, "--level", "fast", "--save", into, "--json"];
    let size = ["--set=camera.width_px=320", "--set=camera.height_px=240"];
    let filmed = vocc(&[&link[..], &size, more].concat());
    says(&filmed, 0, &[]);
    json(&filmed)
}

/// For each message, its text, the verdict about its signer and the counter.
fn verdicts(arguments: &[&str], status: i32) -> Vec<(String, String, Option<u64>)> {
    let received = vocc(&[&["receive", "--json"], arguments].concat());
    says(&received, status, &[]);
    let told = json_lines(&received).into_iter().filter(|line| line["message"].is_string());
    let word = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    told.map(|line| (word(&line["message"]), word(&line["verdict"]), line["counter"].as_u64()))
        .collect()
}

fn told(message: &str, verdict: &str, counter: impl Into<Option<u64>>) -> (String, String, Option<u64>) {
    (message.into(), verdict.into(), counter.into())
}

#[test]
fn a_signed_message_is_proven_once_and_a_film_of_it_shown_again_is_replayed() {
    let path = paths("signing-replay");
    let [key, trusted, counters, first, second] = ["key.toml", "keys.toml", "seen.toml", "first", "second"].map(&path);
    write_key(&key, &trusted);
    let sent = film("hi", &first, &["--sign", &key, "--counter", "41"]);
    assert_eq!((&sent["verdict"], &sent["counter"]), (&"proven".into(), &41.into()));
    film("ho", &second, &["--sign", &key, "--counter", "42"]);

    let trust = ["--trust", &trusted, "--counters", &counters];
    let receive = |film: &str| verdicts(&[&[film], &trust[..]].concat(), 0);
    assert_eq!(receive(&first), [told("hi", "unproven", None), told("hi", "proven", 41)]);
    assert_eq!(receive(&first), [told("hi", "unproven", None), told("hi", "replayed", 41)]);
    assert_eq!(receive(&second), [told("ho", "unproven", None), told("ho", "proven", 42)]);
    assert_eq!(receive(&first)[1], told("hi", "replayed", 41));
    let kept = std::fs::read_to_string(&counters).expect("counters");
    assert!(kept.ends_with("= 42\n"), "{kept}");
    // Without the stored counters, a replay is not recognised.
    assert_eq!(verdicts(&[&first, "--trust", &trusted], 0)[1], told("hi", "proven", 41));
}

#[test]
fn only_what_is_proven_is_told_where_that_is_asked_for() {
    let path = paths("signing-only-trusted");
    let [key, trusted, other, others, signed, unsigned, bytes] =
        ["key.toml", "keys.toml", "other.toml", "others.toml", "signed", "unsigned", "bytes"].map(&path);
    write_key(&key, &trusted);
    write_key(&other, &others);
    film("hi", &signed, &["--sign", &key, "--counter", "1"]);
    film("hi", &unsigned, &[]);

    let only = ["--only-trusted", "--trust"];
    let proven = verdicts(&[&[&signed, "--out", &bytes], &only[..], &[&trusted]].concat(), 0);
    assert_eq!(proven, [told("hi", "proven", 1)]);
    assert_eq!(std::fs::read(&bytes).expect("bytes"), b"hi");
    for (film, trusted, word) in [(&signed, &others, "unknown"), (&unsigned, &trusted, "unsigned")] {
        let received = vocc(&[&["receive", film], &only[..], &[trusted]].concat());
        says(&received, 1, &[word, "not proven: 1", "no proven message"]);
        assert_eq!(text(&received.stdout), "");
    }
    let all = verdicts(&[&unsigned, "--trust", &trusted], 0);
    assert_eq!(all, [told("hi", "unproven", None), told("hi", "unsigned", None)]);
}

#[test]
fn without_keys_the_signer_is_named_as_not_checked() {
    let path = paths("signing-unchecked");
    let [key, trusted, signed, unsigned] = ["key.toml", "keys.toml", "signed", "unsigned"].map(&path);
    write_key(&key, &trusted);
    film("hi", &signed, &["--sign", &key, "--counter", "41"]);
    film("hi", &unsigned, &[]);
    let id = json(&vocc(&["keys", "show", &key, "--json"]))["signer"].clone();
    let id = id.as_str().expect("the key's name");

    let claim = format!("signed by {id}, not checked, counter 41");
    for (film, words) in [(&signed, [&claim[..], "--trust checks it"]), (&unsigned, ["unsigned", "panel 0"])] {
        let as_text = vocc(&["receive", film]);
        says(&as_text, 0, &words);
        // Standard output has one line a message, as for scripts of before.
        let [printed, remarks] = [&as_text.stdout, &as_text.stderr].map(|bytes| text(bytes));
        assert_eq!((printed.lines().count(), printed.contains("signed")), (1, false), "{printed}");
        assert!(!printed.contains("proven") && !remarks.contains("proven"), "{printed}{remarks}");

        let lines = json_lines(&vocc(&["receive", "--json", film]));
        let messages: Vec<_> = lines.iter().filter(|line| line["message"].is_string()).collect();
        assert_eq!((messages.len(), messages[0].get("verdict")), (1, None), "{lines:?}");
        let told: Vec<_> = lines.iter().filter(|line| line["verdict"].is_string()).collect();
        let expected = match film == &signed {
            true => serde_json::json!({ "panel": 0, "verdict": "unchecked", "signer": id, "signer_name": null, "counter": 41 }),
            false => serde_json::json!({ "panel": 0, "verdict": "unsigned" }),
        };
        assert_eq!(told, [&expected]);
    }
}

#[test]
fn a_message_signed_anew_is_proven_anew() {
    let path = paths("signing-anew");
    let [key, trusted, first, second] = ["key.toml", "keys.toml", "first", "second"].map(&path);
    write_key(&key, &trusted);
    film("hi", &first, &["--sign", &key, "--counter", "41"]);
    film("hi", &second, &["--sign", &key, "--counter", "42"]);
    let frames = |film: &str| std::fs::read_dir(film).expect("a folder").count();
    for number in 0..frames(&second) {
        let frame = |film: &str, number| format!("{film}/frame-{number:06}.png");
        let _ = std::fs::rename(frame(&second, number), frame(&first, 1000 + number));
    }
    let expected = [told("hi", "proven", 41), told("hi", "proven", 42)];
    assert_eq!(verdicts(&[&first, "--trust", &trusted, "--only-trusted"], 0), expected);
}

#[test]
fn a_signature_under_another_keys_name_is_forged() {
    let path = paths("signing-forged");
    let [key, trusted, other, film_of_it] = ["key.toml", "keys.toml", "other.toml", "film"].map(&path);
    write_key(&key, &trusted);
    write_key(&other, &path("others.toml"));
    film("hi", &film_of_it, &["--sign", &other, "--counter", "1"]);
    // A trusted key whose name equals the signer's, but which differs in the sign of its x coordinate, its last bit.
    let shown = json(&vocc(&["keys", "show", &other, "--json"]));
    let public = shown["public"].as_str().expect("a key");
    let last = u8::from_str_radix(&public[62..], 16).expect("digits") ^ 0x80;
    let twin = format!("[[key]]\nname = \"twin\"\npublic = \"{}{last:02x}\"\n", &public[..62]);
    std::fs::write(&trusted, twin).expect("a file");
    assert_eq!(verdicts(&[&film_of_it, "--trust", &trusted], 0)[1], told("hi", "forged", 1));
}

#[test]
fn verdicts_are_recorded() {
    let path = paths("signing-recorded");
    let [key, trusted, film_of_it, recording] = ["key.toml", "keys.toml", "film", "film.mcap"].map(&path);
    write_key(&key, &trusted);
    film("hi", &film_of_it, &["--sign", &key, "--counter", "7"]);
    says(&vocc(&["receive", &film_of_it, "--trust", &trusted, "--mcap", &recording]), 0, &[]);
    let bytes = std::fs::read(&recording).expect("a recording");
    let messages: Vec<_> = MessageStream::new(&bytes)
        .expect("an MCAP file")
        .collect::<Result<_, _>>()
        .expect("whole messages");
    let verdicts = messages.iter().filter(|message| message.channel.topic == "/panel_0/verdict");
    let verdicts: Vec<String> = verdicts.map(|message| cdr::deserialize(&message.data).expect("a text")).collect();
    assert_eq!(verdicts.len(), 2);
    assert!(verdicts[0].contains("unproven"), "{verdicts:?}");
    assert!(
        verdicts[1].contains("proven: signed by truck 12 (") && verdicts[1].contains("counter 7"),
        "{verdicts:?}"
    );
}

#[test]
fn signed_panels_begin_with_those_of_the_message() {
    let path = paths("signing-transmit");
    let key = path("key.toml");
    write_key(&key, &path("keys.toml"));
    let panels = |more: &[&str]| text(&vocc(&[&["transmit", "--message", "hi"], more].concat()).stdout);
    let (unsigned, signed) = (panels(&[]), panels(&["--sign", &key, "--counter", "3"]));
    assert!(signed.starts_with(&unsigned));
    assert_eq!((unsigned.lines().count(), signed.lines().count()), (5, 25));
    assert_eq!(signed, panels(&["--sign", &key, "--counter", "3"]));
    assert_ne!(signed, panels(&["--sign", &key, "--counter", "4"]));
    for option in ["--raw", "--flicker"] {
        refused(
            &["transmit", "--message", "hi", "--sign", &key, option],
            &["--sign cannot be used with"],
        );
    }
}

#[cfg(unix)]
#[test]
fn a_private_key_is_its_owners_alone_and_never_overwritten() {
    use std::os::unix::fs::PermissionsExt;
    let path = paths("signing-keys");
    let key = path("key.toml");
    says(&vocc(&["keys", "new", &key, "--name", "truck 12"]), 0, &[]);
    let mode = |path: &str| std::fs::metadata(path).expect("there").permissions().mode() & 0o777;
    assert_eq!(mode(&key), 0o600);
    let before = std::fs::read_to_string(&key).expect("a key");
    refused(&["keys", "new", &key], &["exists"]);
    assert_eq!(std::fs::read_to_string(&key).expect("a key"), before);
    let secret = before.lines().find_map(|line| line.strip_prefix("secret = ")).expect("a secret");
    let shown = vocc(&["keys", "show", &key]);
    says(&shown, 0, &[]);
    assert!(text(&shown.stdout).starts_with('#') && !text(&shown.stdout).contains(secret.trim_matches('"')));
    std::fs::set_permissions(&key, PermissionsExt::from_mode(0o640)).expect("set");
    refused(&["keys", "show", &key], &["other users", "chmod 600"]);
}

#[test]
fn files_that_hold_no_keys_are_refused_with_a_way_out_and_no_secret() {
    let path = paths("signing-refused");
    let [key, trusted, bad] = ["key.toml", "keys.toml", "bad.toml"].map(&path);
    write_key(&key, &trusted);
    let text_of = |file: &str| std::fs::read_to_string(file).expect("a file");
    let write = |text: &str| {
        let _ = std::fs::remove_file(&bad);
        std::fs::write(&bad, text).expect("a file");
        #[cfg(unix)]
        std::fs::set_permissions(&bad, std::os::unix::fs::PermissionsExt::from_mode(0o600)).expect("set");
    };
    let film_of_it = path("film");
    film("hi", &film_of_it, &[]);
    let receive = |trusted: &str, words: &[&str]| refused(&["receive", &film_of_it, "--trust", trusted], words);
    receive(&path("none.toml"), &["cannot read"]);
    receive(&key, &["holds a private key", "vocc keys show"]);
    write("");
    receive(&bad, &["holds no key"]);
    write("[[key]]\nname = \"a\"\npublic = \"12\"\n");
    receive(&bad, &["64 hexadecimal digits"]);
    write(&format!("[[key]]\nname = \"a\"\npublic = \"{}\"\n", "02".repeat(32)));
    receive(&bad, &["not an Ed25519 key"]);
    write(&text_of(&trusted).repeat(2));
    receive(&bad, &["have the same id"]);
    let named = |name: &str| text_of(&trusted).replace("truck 12", name);
    write(&named("a\\nb"));
    receive(&bad, &["is not a name"]);
    write("[[key]]\nnane = 3\n");
    receive(&bad, &["holds no public keys"]);
    // A truncated file has lost the stored counters.
    for damaged in ["[last]\nx = \"y\"\n", "", "# The greatest counter"] {
        write(damaged);
        refused(
            &["receive", &film_of_it, "--trust", &trusted, "--counters", &bad],
            &["holds no counters"],
        );
    }
    refused(
        &["receive", &film_of_it, "--trust", &trusted, "--counters", &trusted],
        &["would be overwritten"],
    );
    refused(&["receive", &film_of_it, "--only-trusted"], &["--trust"]);

    let refused_in_secret = |arguments: &[&str], words: &[&str]| {
        let refusal = vocc(arguments);
        says(&refusal, 2, words);
        let secret = text_of(&key);
        let secret = secret.lines().find_map(|line| line.strip_prefix("secret = \"")).expect("a secret");
        assert!(!text(&refusal.stderr).contains(&secret[..32]), "{}", text(&refusal.stderr));
    };
    // A private key without its last quotation mark in place of public keys.
    write(text_of(&key).trim_end_matches(['"', '\n']));
    refused_in_secret(&["keys", "show", &bad], &["holds no public keys"]);
    refused_in_secret(&["receive", &film_of_it, "--trust", &bad], &["holds no public keys"]);
    let sign = |words: &[&str]| refused_in_secret(&["transmit", "--message", "hi", "--sign", &bad], words);
    write(&text_of(&key).replace("secret = \"", "secret = 7 # \""));
    sign(&["holds no private key"]);
    write(&text_of(&key).replace("secret = \"", "secret = \"0"));
    sign(&["64 hexadecimal digits"]);
    let other = path("other.toml");
    write_key(&other, &path("others.toml"));
    let public = |file: &str| {
        text_of(file)
            .lines()
            .find(|line| line.starts_with("public"))
            .expect("a key")
            .to_owned()
    };
    write(&text_of(&key).replace(&public(&key), &public(&other)));
    sign(&["is not that of the private one"]);
    refused(&["keys", "new", &path("new.toml"), "--name", "a\nb"], &["is not a name"]);
    assert!(!Path::new(&path("new.toml")).exists());
}
