//! Signed messages that are forged, altered or replayed: none is proven.

use link::fec::Code;
use link::framing::{Deframer, Event, Framer, KeyId, Rejection, Signature, SignedFramer};
use link::panel::{PanelFrame, SoftPanel};
use link::scramble::split_mix64;
use link::signing::{PublicKey, SecretKey, TrustedKey, Verdict, verdict};

/// Certainty of clean readings.
const CLEAN: i8 = 24;

/// Pseudorandom numbers that are the same in each run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 += 1;
        split_mix64(self.0)
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    fn message(&mut self) -> Vec<u8> {
        let length = 1 + self.below(64);
        (0..length).map(|_| self.next() as u8).collect()
    }
}

fn key(seed: u8) -> SecretKey {
    SecretKey::from_seed([seed; 32]).expect("a key")
}

/// A message and its signature, altered as an attacker without the key can alter them.
fn bend(numbers: &mut Numbers, message: &mut Vec<u8>, signature: &mut Signature, other: &(Vec<u8>, Signature)) {
    let flip = |bytes: &mut [u8], numbers: &mut Numbers| {
        let bit = numbers.below(8 * bytes.len());
        bytes[bit / 8] ^= 1 << (bit % 8);
    };
    match numbers.below(11) {
        0 => flip(message, numbers),
        1 => signature.counter ^= 1 << numbers.below(32),
        2 => flip(&mut signature.key.0, numbers),
        3 => flip(&mut signature.proof, numbers),
        // Cut off, or extended with zeros, which a checksum alone may not detect.
        4 if message.len() > 1 => message.truncate(1 + numbers.below(message.len() - 1)),
        4 | 5 => message.push(0),
        6 => signature.proof = other.1.proof,
        7 => *signature = other.1,
        8 => message.clone_from(&other.0),
        // The rest of the signature was not received. It may end with zeros.
        9 => {
            let (whole, received) = (signature.proof, numbers.below(signature.proof.len()));
            signature.proof[received..].fill(0);
            if signature.proof == whole {
                flip(&mut signature.proof, numbers);
            }
        }
        // Signed with another key, under the name of the trusted one.
        _ => {
            let forged = key(99).sign(message, signature.counter);
            signature.proof = forged.proof;
        }
    }
}

fn none_of_is_proven(count: u64) {
    let key = key(1);
    let mut numbers = Numbers(0);
    let mut other = (b"another message".to_vec(), key.sign(b"another message", u32::MAX));
    let (mut forged, mut unknown) = (0, 0);
    for counter in 0..count {
        let mut message = numbers.message();
        let mut signature = key.sign(&message, counter as u32);
        let genuine = (message.clone(), signature);
        bend(&mut numbers, &mut message, &mut signature, &other);
        let mut trusted = [TrustedKey::new(key.public(), None)];
        match verdict(&mut trusted, &message, &signature) {
            Verdict::Forged { .. } => forged += 1,
            Verdict::Unknown { .. } => unknown += 1,
            verdict => panic!("{counter}: {verdict}"),
        }
        other = genuine;
    }
    assert_eq!(forged + unknown, count);
    assert!(unknown > count / 20 && forged > count / 2, "{forged} forged, {unknown} unknown");
}

/// A million take some minutes.
#[test]
fn no_forged_or_bent_message_is_proven() {
    none_of_is_proven(properties::cases(5_000, 1_000_000).into());
}

#[test]
fn what_is_shown_again_is_replayed_over_ten_thousand_messages_and_restarts() {
    let key = key(2);
    let mut numbers = Numbers(1);
    let mut trusted = [TrustedKey::new(key.public(), None)];
    let (mut filmed, mut counter, mut replays) = (Vec::new(), 0, 0);
    for number in 0..10_000_u32 {
        // A transmitter that restarts skips counters, but never uses one twice.
        counter += 1 + if numbers.below(50) == 0 { 256 } else { 0 };
        let message = number.to_le_bytes();
        let signature = key.sign(&message, counter);
        let signer = signature.key;
        assert_eq!(verdict(&mut trusted, &message, &signature), Verdict::Proven { signer, counter });
        filmed.push((message, signature));
        if numbers.below(20) == 0 {
            // The receiver restarts with its stored state.
            trusted = trusted.map(|trusted| TrustedKey::new(trusted.key(), trusted.last()));
        }
        if numbers.below(4) == 0 {
            let (message, signature) = filmed[numbers.below(filmed.len())];
            let replayed = Verdict::Replayed {
                signer,
                counter: signature.counter,
                last: counter,
            };
            assert_eq!(verdict(&mut trusted, &message, &signature), replayed);
            replays += 1;
        }
    }
    assert!(replays > 2000, "{replays}");
}

/// The receiver's results: messages, and signatures with their messages.
#[derive(Default)]
struct Brought {
    messages: Vec<Vec<u8>>,
    signed: Vec<(Vec<u8>, Signature)>,
    unsigned: u32,
    /// The panels at which the first message and the first signature were complete.
    first: [Option<u32>; 2],
}

fn receive(panels: impl IntoIterator<Item = SoftPanel>) -> Brought {
    let mut deframer = Box::new(Deframer::new());
    let mut brought = Brought::default();
    for (index, panel) in (0..).zip(panels) {
        match deframer.push(index, 0, &panel) {
            Event::Delivered(delivery) => {
                brought.messages.push(delivery.message.to_vec());
                brought.first[0].get_or_insert(index);
            }
            Event::Signed(signed) => {
                brought.signed.push((signed.message.to_vec(), signed.signature));
                brought.first[1].get_or_insert(index);
            }
            Event::Header { unsigned: true, .. } => brought.unsigned += 1,
            _ => {}
        }
    }
    brought
}

fn signed(message: &[u8], counter: u32) -> SignedFramer {
    let signature = key(3).sign(message, counter);
    SignedFramer::new(message, Code::for_length(message.len()), false, signature).expect("a message")
}

fn clean(panel: PanelFrame) -> SoftPanel {
    SoftPanel::certain(panel, CLEAN)
}

#[test]
fn a_signature_is_told_once_for_messages_of_any_length() {
    for length in [1, 8, 48, 72, 128, 129, 1024] {
        let message = vec![0x5a; length];
        let mut framer = signed(&message, 5);
        let round = framer.panels_per_repeat();
        let brought = receive((0..3 * round).map(|_| clean(framer.next_panel())));
        assert_eq!(brought.messages, [&message[..]]);
        assert_eq!(brought.signed, [(message.clone(), key(3).sign(&message, 5))]);
        assert_eq!(brought.unsigned, 0);
        // The text arrives first, as soon as without a signature.
        let repeat = Framer::new(&message, Code::for_length(length), false).unwrap().panels_per_repeat();
        assert_eq!(brought.first, [Some(repeat - 1), Some(round - 1)]);
    }
}

#[test]
fn a_message_joined_at_any_panel_is_proven_within_two_rounds() {
    for skipped in 0..33 {
        let mut framer = signed(&[7; 48], 5);
        for _ in 0..skipped {
            framer.next_panel();
        }
        let rounds = 2 * framer.panels_per_repeat();
        let brought = receive((0..rounds).map(|_| clean(framer.next_panel())));
        assert_eq!((brought.messages.len(), brought.signed.len()), (1, 1), "{skipped}");
    }
}

#[test]
fn a_message_signed_anew_is_told_anew() {
    let mut framer = signed(b"ice", 5);
    let round = framer.panels_per_repeat();
    let panels: Vec<_> = (5..9)
        .flat_map(|counter| {
            framer.sign_anew(key(3).sign(b"ice", counter));
            (0..round).map(|_| clean(framer.next_panel())).collect::<Vec<_>>()
        })
        .collect();
    let brought = receive(panels);
    assert_eq!(brought.messages.len(), 1);
    let counters: Vec<u32> = brought.signed.iter().map(|(_, signature)| signature.counter).collect();
    assert_eq!(counters, [5, 6, 7, 8]);
}

#[test]
fn an_unsigned_message_is_told_to_be_when_it_begins_anew() {
    for length in [1, 48, 72, 300] {
        let message = vec![3; length];
        let mut framer = Framer::new(&message, Code::for_length(length), false).unwrap();
        let repeats = 3 * framer.panels_per_repeat();
        let brought = receive((0..repeats).map(|_| clean(framer.next_panel())));
        assert_eq!((brought.unsigned, brought.signed.len()), (2, 0), "{length} bytes");
    }
}

#[test]
fn a_signature_that_no_single_reading_shows_is_summed_from_its_repeats() {
    let mut numbers = Numbers(2);
    let mut framer = signed(&[7; 48], 5);
    let round = framer.panels_per_repeat();
    let message_panels = Framer::new(&[7; 48], Code::for_length(48), false).unwrap().panels_per_repeat();
    let mut undecodable = 0;
    let mut deframer = Box::new(Deframer::new());
    let mut signed = 0;
    for index in 0..12 * round {
        let panel = framer.next_panel();
        // Sync and header are without errors, but many LEDs of the signature's payload are read wrongly.
        let is_bent = index % round >= message_panels + 3;
        let mask = if is_bent {
            numbers.next() & numbers.next() & numbers.next()
        } else {
            0
        };
        match deframer.push(index, 0, &clean(PanelFrame::from_bits(panel.bits() ^ mask))) {
            Event::Rejected(Rejection::SignatureUndecodable(_)) => undecodable += 1,
            Event::Signed(_) => signed += 1,
            _ => {}
        }
    }
    assert!(undecodable > 0 && signed == 1, "{undecodable} undecodable, {signed} signed");
}

#[test]
fn a_header_of_a_signature_that_is_not_readable_is_recognised() {
    let mut framer = signed(&[7; 48], 5);
    let again = key(3).sign(&[7; 48], 6);
    let round = framer.panels_per_repeat();
    let message_panels = Framer::new(&[7; 48], Code::for_length(48), false).unwrap().panels_per_repeat();
    let mut panels: Vec<_> = (0..2 * round).map(|_| clean(framer.next_panel())).collect();
    // The first one's payload and the second one's sync panel are lost.
    (message_panels + 3..round).for_each(|panel| panels[panel as usize] = SoftPanel::ERASED);
    panels[(round + message_panels) as usize] = SoftPanel::ERASED;
    let brought = receive(panels);
    assert_eq!(brought.signed.len(), 1);
    assert_ne!(brought.signed[0].1, again);
}

#[test]
fn panels_of_one_message_before_the_signature_of_another_prove_nothing() {
    let mut trusted = [TrustedKey::new(key(3).public(), None)];
    let (mut one, mut other) = (signed(b"no ice", 5), signed(b"ice", 6));
    let message_panels = one.panels_per_repeat() as usize - link::framing::SIGNATURE_PANELS;
    let one: Vec<_> = (0..one.panels_per_repeat()).map(|_| clean(one.next_panel())).collect();
    let other: Vec<_> = (0..other.panels_per_repeat()).map(|_| clean(other.next_panel())).collect();
    let spliced = one[..message_panels].iter().chain(&other[message_panels..]).copied();
    let brought = receive(spliced);
    assert_eq!((brought.messages.len(), brought.signed.len()), (1, 0));
    // The header of one with the payload of the other.
    let spliced = one[..message_panels + 3].iter().chain(&other[message_panels + 3..]).copied();
    for (message, signature) in receive(spliced).signed {
        assert!(matches!(verdict(&mut trusted, &message, &signature), Verdict::Forged { .. }));
    }
}

#[test]
fn panels_bent_at_random_prove_only_what_was_signed() {
    let mut numbers = Numbers(3);
    let (mut proven, mut rejected) = (0, 0);
    for counter in 0..300 {
        let message = numbers.message();
        let signature = key(3).sign(&message, counter);
        let mut framer = SignedFramer::new(&message, Code::for_length(message.len()), false, signature).unwrap();
        let rounds = 2 * framer.panels_per_repeat();
        let share = 1 + numbers.below(3);
        let bent = |panel: PanelFrame| {
            let mask = (0..=share).fold(u64::MAX, |mask, _| mask & numbers.next());
            clean(PanelFrame::from_bits(panel.bits() ^ mask))
        };
        let panels: Vec<_> = (0..rounds).map(|_| framer.next_panel()).map(bent).collect();
        let mut trusted = [TrustedKey::new(key(3).public(), None)];
        for (read, signature) in receive(panels).signed {
            match verdict(&mut trusted, &read, &signature) {
                Verdict::Proven { .. } => {
                    assert_eq!(read, message);
                    proven += 1;
                }
                _ => rejected += 1,
            }
        }
    }
    assert!(proven > 50, "{proven} proven, {rejected} rejected");
}

#[test]
fn keys_come_back_from_their_bytes() {
    let public = key(4).public();
    assert_eq!(PublicKey::from_bytes(public.to_bytes()), Ok(public));
    assert_eq!(public.id(), KeyId(public.to_bytes()[..4].try_into().unwrap()));
}
