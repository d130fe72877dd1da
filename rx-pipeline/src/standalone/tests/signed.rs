//! The verdicts on messages come out of the port.

use super::*;
use link::framing::{Signature, SignedFramer};
use link::signing::{KEY_BYTES, SecretKey, Verdict};
use std::format;

/// A word, shown again and again, with a signature or without.
fn shown(word: &[u8], signature: Option<Signature>) -> Vec<u64> {
    let code = Code::for_length(word.len());
    let mut framer = match signature {
        Some(signature) => SignedFramer::new(word, code, false, signature).unwrap(),
        None => Framer::new(word, code, false).unwrap().into(),
    };
    (0..4000).map(|_| framer.next_panel().bits()).collect()
}

fn key(seed: u8) -> SecretKey {
    SecretKey::from_seed([seed; KEY_BYTES]).unwrap()
}

/// The lines about messages while each word is shown for a while.
fn lines(trust: Trust, words: &[(&'static [u8], Option<Signature>)]) -> (Vec<String>, Verdict) {
    let (mut application, mut bench) = (in_integers(BINNED, 9_000), Bench::default());
    let mut scene = Scene::new(BINNED, 9_000, b"fog");
    application.trust(Ok(trust));
    application.start(&mut bench);
    for (word, signature) in words {
        scene.symbols = shown(word, *signature);
        run(&mut application, &mut bench, &mut scene, 300);
        assert_eq!(application.message(), *word);
        // The signature follows.
        run(&mut application, &mut bench, &mut scene, 100);
    }
    let text = bench.text();
    let about = text
        .lines()
        .filter(|line| line.starts_with("message") || line.starts_with("verdict"));
    let about = about.map(String::from).collect();
    let verdict = ask(&mut application, &mut bench, 1, Request::Message, |answer| {
        let Answer::Message(message) = answer else { panic!("{answer:?}") };
        message.verdict
    });
    (about, verdict)
}

#[test]
fn each_message_gets_its_verdict() {
    let (own, other) = (key(1), key(2));
    let (signer, stranger) = (own.public().id(), other.public().id());
    let (told, last) = lines(
        Trust::parse(&trust::tests::lines(1)).unwrap(),
        &[
            (b"ice", Some(own.sign(b"ice", 7))),
            (b"fog", Some(own.sign(b"ice", 8))),
            (b"jam", None),
            (b"mud", Some(own.sign(b"mud", 6))),
            (b"elk", Some(other.sign(b"elk", 9))),
        ],
    );
    let unproven = "verdict: unproven: no signature has come yet";
    let expected = [
        "message: ice",
        unproven,
        &format!("verdict: proven: signed by {signer}, counter 7"),
        "message: fog",
        unproven,
        &format!("verdict: forged: {signer} has not signed this, counter 8"),
        "message: jam",
        unproven,
        "verdict: unsigned",
        "message: mud",
        unproven,
        &format!("verdict: replayed: signed by {signer}, counter 6, and counter 7 was seen before"),
        "message: elk",
        unproven,
        &format!("verdict: unknown: it names key {stranger}, which is not trusted, counter 9"),
    ];
    assert_eq!(told, expected);
    assert_eq!(
        last,
        Verdict::Unknown {
            signer: stranger,
            counter: 9
        }
    );
}

#[test]
fn without_keys_nothing_is_checked() {
    let own = key(1);
    let signer = own.public().id();
    let (told, last) = lines(Trust::default(), &[(b"ice", Some(own.sign(b"ice", 7))), (b"jam", None)]);
    let expected = [
        "message: ice",
        &format!("verdict: signed by {signer}, not checked, counter 7"),
        "message: jam",
        "verdict: unsigned",
    ];
    assert_eq!((told, last), (expected.map(String::from).to_vec(), Verdict::Unsigned));
}

#[test]
fn an_unusable_list_is_a_lasting_fault_and_nothing_is_proven() {
    let (mut application, mut bench) = (in_integers(BINNED, 9_000), Bench::default());
    let mut scene = Scene::new(BINNED, 9_000, b"ice");
    scene.symbols = shown(b"ice", Some(key(1).sign(b"ice", 7)));
    application.trust(Trust::parse("[[key]]\npublic = \"12\"\n"));
    application.start(&mut bench);
    let fault = Fault::Keys(TrustError::Digits { line: 2 });
    assert_eq!(application.fault(), Some(fault));
    for frames in [300, 100] {
        run(&mut application, &mut bench, &mut scene, frames);
    }
    assert_eq!((application.message(), application.fault()), (&b"ice"[..], Some(fault)));
    let text = bench.text();
    assert!(text.contains(&format!("fault: {fault}\r\n")), "{text}");
    assert!(text.contains("not checked") && !text.contains("proven: signed"), "{text}");
    // Another fault passes, and this one stays.
    application.no_frame(&mut bench);
    assert_eq!(application.fault(), Some(Fault::NoFrames));
    run(&mut application, &mut bench, &mut scene, 10);
    assert_eq!(application.fault(), Some(fault));
}
