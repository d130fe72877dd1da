//! Compares verdicts on signed messages with this computer's.

use std::io::Write;

use link::framing::{MESSAGE_MAX, Signature, SignedPayload};
use link::signing::{SecretKey, Verdict};
use reception::keys::NamedKey;
use rx_pipeline::standalone::Trust;
use serde::Serialize;
use vocc_tests::firmware::{say, size};

use crate::Images;
use crate::board::AN505;
use crate::cases::{BYTES, Case, Head, Report};

/// Maximum number of instructions for a verdict on a short message.
const INSTRUCTIONS_MAX: u64 = 5_000_000;
const STACK_MAX: u32 = 10 * 1024;

/// The lines of `vocc keys show`.
fn lines(key: &SecretKey) -> String {
    let (name, key) = ("truck".into(), key.public());
    NamedKey { name, key }.to_toml().expect("TOML")
}

/// Messages with their signatures: genuine, shown again, signed anew, changed in each part, by an unknown key, and long.
fn cases() -> (String, Vec<(Vec<u8>, Signature)>) {
    let [own, other, unknown] = [1, 2, 3].map(|seed| SecretKey::from_seed([seed; 32]).expect("a key"));
    let short = b"ice on the bridge".to_vec();
    let signature = own.sign(&short, 7);
    let mut cases = vec![
        (short.clone(), signature),
        (short.clone(), signature),
        (short.clone(), own.sign(&short, 8)),
    ];
    let forged = |change: fn(&mut Signature)| {
        let mut forged = own.sign(b"ice on the bridge", 9);
        change(&mut forged);
        (short.clone(), forged)
    };
    cases.extend([
        forged(|signature| signature.proof[0] ^= 1),
        forged(|signature| signature.proof[32] ^= 1),
        forged(|signature| signature.proof[63] |= 0xe0),
        forged(|signature| signature.counter += 1),
        (b"ice on the Bridge".to_vec(), own.sign(&short, 9)),
        (short.clone(), unknown.sign(&short, 9)),
        (vec![b'm'; MESSAGE_MAX], other.sign(&[b'm'; MESSAGE_MAX], 1)),
    ]);
    (lines(&own) + &lines(&other), cases)
}

fn put(memory: &mut Vec<u8>, value: &impl Serialize) {
    let bytes = &mut vec![0; BYTES];
    memory.extend_from_slice(postcard::to_slice(value, bytes).expect("there is room"));
}

/// The Cortex-M33 finds the same verdicts as this computer, soon enough and on a small stack.
pub fn verdicts_are_those_of_this_computer(images: &Images) {
    let (keys, cases) = cases();
    let mut memory = vec![];
    put(
        &mut memory,
        &Head {
            keys: &keys,
            cases: cases.len() as u32,
        },
    );
    for (message, signature) in &cases {
        let signature = &signature.to_bytes();
        put(&mut memory, &Case { message, signature });
    }
    memory.resize(BYTES, 0);
    let mut file = tempfile::NamedTempFile::new().expect("a file");
    file.write_all(&memory).expect("the cases are written");
    let reports: Vec<Report> = AN505.run(&images.verdicts, file.path());

    let mut trust = Trust::parse(&keys).expect("keys");
    let expected = cases.iter().map(|(message, signature)| {
        let signature = *signature;
        trust.verdict(&SignedPayload { message, signature })
    });
    let verdicts: Vec<Verdict> = reports.iter().map(|report| report.verdict).collect();
    assert_eq!(verdicts, expected.collect::<Vec<_>>());
    let names = verdicts.iter().map(Verdict::name).collect::<Vec<_>>();
    let told = [
        "proven", "replayed", "proven", "forged", "forged", "forged", "forged", "forged", "unknown", "proven",
    ];
    assert_eq!(names, told);

    let took = |at: usize| AN505.instructions(reports[at].ticks);
    let stack_bytes = reports[0].stack_bytes;
    let flash = size(&std::fs::read(&images.verdicts).expect("the image is built")).flash;
    say(&format!(
        "Cortex-M33: {} instructions for the verdict on {} bytes, {} on {MESSAGE_MAX}; stack {stack_bytes} bytes, flash {flash} with the \
         board's start",
        took(0),
        cases[0].0.len(),
        took(cases.len() - 1),
    ));
    assert!(took(0) <= INSTRUCTIONS_MAX && stack_bytes <= STACK_MAX);
}
