//! Whole links: the framer, a channel, the deframer.

mod channel;

use channel::{Channel, Noise};
use link::checksum::crc32c;
use link::fec::Code;
use link::framing::{Deframer, Event, Framer, Header, Rejection, SYNC, SegmentOutcome};
use link::geometry::Geometry;
use link::l2a_table::Interval;
use link::orientation::Orientation;
use link::panel::{PanelFrame, SoftPanel};
use link::scramble;
use properties::prelude::*;

const CLEAN: i8 = 12;

fn code(value: u8) -> Code {
    Code::from_value(value).unwrap()
}

fn any_message() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        3 => prop::collection::vec(any::<u8>(), 1..=64),
        1 => prop::collection::vec(any::<u8>(), 1..=1024),
    ]
}

/// A receiver that records its events.
struct Listener {
    deframer: Box<Deframer>,
    index: u32,
    messages: Vec<Vec<u8>>,
    headers: u32,
    expected_headers: u32,
    beacons: u32,
    sizes: Vec<Geometry>,
    failed_segments: u32,
    corrupt: u32,
    bits: (u32, u32),
    stamps: (u64, u64),
}

impl Listener {
    fn new() -> Self {
        Self {
            deframer: Box::new(Deframer::new()),
            index: 0,
            messages: Vec::new(),
            headers: 0,
            expected_headers: 0,
            beacons: 0,
            sizes: Vec::new(),
            failed_segments: 0,
            corrupt: 0,
            bits: (0, 0),
            stamps: (0, 0),
        }
    }

    /// The next panel; its stamp is 1000 more than its index.
    fn hear(&mut self, panel: &SoftPanel) {
        match self.deframer.push(self.index, u64::from(self.index) + 1000, panel) {
            Event::Delivered(delivery) => {
                self.messages.push(delivery.message.to_vec());
                self.bits = (delivery.corrected_bits, delivery.coded_bits);
                self.stamps = (delivery.first_stamp, delivery.last_stamp);
            }
            Event::Header { expected, .. } => {
                self.headers += 1;
                self.expected_headers += u32::from(expected);
            }
            Event::Beacon { .. } => self.beacons += 1,
            Event::Geometry(geometry) => self.sizes.push(geometry),
            Event::Segment {
                outcome: SegmentOutcome::Failed(_),
                ..
            } => self.failed_segments += 1,
            Event::Rejected(Rejection::MessageCorrupt { .. }) => self.corrupt += 1,
            Event::Nothing | Event::Rejected(_) | Event::Segment { .. } | Event::UnsupportedVersion(_) | Event::Signed(_) => {}
        }
        self.index += 1;
    }

    /// The next panel does not arrive.
    fn miss(&mut self) {
        self.index += 1;
    }

    fn hear_clean(&mut self, panel: PanelFrame) {
        self.hear(&SoftPanel::certain(panel, CLEAN));
    }

    /// `repeats` repeats without a wrong bit.
    fn hear_repeats(&mut self, framer: &mut Framer, repeats: u32) {
        for _ in 0..repeats * framer.panels_per_repeat() {
            self.hear_clean(framer.next_panel());
        }
    }
}

properties! {
    #![cases(96)]

    #[test]
    fn any_message_comes_back_under_any_code(value in 0_u8..5, message in any_message(), fresh: bool) {
        let mut framer = Framer::new(&message, code(value), fresh).unwrap();
        let mut listener = Listener::new();
        listener.hear_repeats(&mut framer, 3);
        prop_assert_eq!(&listener.messages, &[message]);
        prop_assert_eq!(listener.bits.0, 0);
        prop_assert_eq!(listener.stamps, (1000, 999 + u64::from(framer.panels_per_repeat())));
    }

    #[test]
    fn it_comes_back_from_any_starting_panel_within_a_repeat_and_a_segment(
        value in 0_u8..5, message in any_message(), start: prop::sample::Index,
    ) {
        let mut framer = Framer::new(&message, code(value), true).unwrap();
        let repeat = framer.panels_per_repeat();
        let longest_segment = (3 + code(value).panels() as u32).min(repeat);
        for _ in 0..start.index(2 * repeat as usize) {
            framer.next_panel();
        }
        let mut listener = Listener::new();
        for _ in 0..repeat + longest_segment {
            listener.hear_clean(framer.next_panel());
        }
        prop_assert_eq!(listener.messages, [message]);
    }

    #[test]
    fn it_comes_back_whichever_way_up_the_picture_has_the_panel(
        value in 0_u8..5, message in any_message(), way in 0_usize..8, start: prop::sample::Index, seed: u64,
    ) {
        let orientation = Orientation::ALL[way];
        let mut framer = Framer::new(&message, code(value), true).unwrap();
        let repeat = framer.panels_per_repeat();
        let longest_segment = (3 + code(value).panels() as u32).min(repeat);
        for _ in 0..start.index(2 * repeat as usize) {
            framer.next_panel();
        }
        let (channel, mut noise) = (Channel::Bsc(0.005), Noise::new(seed));
        let mut listener = Listener::new();
        for _ in 0..2 * (repeat + longest_segment) {
            listener.hear(&channel.read(framer.next_panel().seen(orientation), &mut noise));
        }
        prop_assert_eq!(listener.messages, [message]);
        prop_assert_eq!(listener.deframer.orientation(), Some(orientation));
    }

    #[test]
    fn it_comes_back_though_one_panel_in_twenty_is_lost(value in 0_u8..5, message in any_message(), seed: u64) {
        let mut framer = Framer::new(&message, code(value), true).unwrap();
        let mut noise = Noise::new(seed);
        let mut listener = Listener::new();
        for _ in 0..12 * framer.panels_per_repeat() {
            let panel = framer.next_panel();
            if noise.uniform() < 0.05 { listener.miss() } else { listener.hear_clean(panel) }
        }
        prop_assert_eq!(listener.messages, [message]);
    }

    #[test]
    fn a_panel_given_again_changes_nothing(value in 0_u8..5, message in any_message(), seed: u64) {
        let mut framer = Framer::new(&message, code(value), true).unwrap();
        let mut noise = Noise::new(seed);
        let mut deframer = Deframer::new();
        let mut delivered = 0;
        for index in 0..framer.panels_per_repeat() {
            let panel = SoftPanel::certain(framer.next_panel(), CLEAN);
            delivered += u32::from(matches!(deframer.push(index, 0, &panel), Event::Delivered(_)));
            while noise.uniform() < 0.4 {
                let earlier = index.wrapping_sub((noise.word() % 4) as u32);
                prop_assert_eq!(deframer.push(earlier, 0, &panel), Event::Nothing);
            }
        }
        prop_assert_eq!(delivered, 1);
    }

    #[test]
    fn noise_is_corrected_and_counted(value in 0_u8..5, message in any_message(), seed: u64) {
        let channel = Channel::Awgn(0.02);
        let mut framer = Framer::new(&message, code(value), false).unwrap();
        let mut noise = Noise::new(seed);
        let mut listener = Listener::new();
        for _ in 0..8 * framer.panels_per_repeat() {
            listener.hear(&channel.read_next(&mut framer, &mut noise));
        }
        prop_assert_eq!(&listener.messages, &[message]);
        let (corrected, coded) = (f64::from(listener.bits.0), f64::from(listener.bits.1));
        let (mean, deviation) = (0.02 * coded, (0.02 * coded).sqrt());
        prop_assert!((corrected - mean).abs() < 6.0 * deviation + 1.0, "{corrected} wrong of {coded}");
    }

    #[test]
    fn any_sequence_of_indices_and_panels_is_taken_without_panic(
        pushes in prop::collection::vec((any::<u32>(), 0_u32..40, any::<u64>(), any::<bool>()), 1..200), value in 0_u8..5,
    ) {
        let mut deframer = Deframer::new();
        let mut framer = Framer::new(&[0x5a; 300], code(value), false).unwrap();
        let mut index = 0_u32;
        for (jump, step, seed, far) in pushes {
            index = if far && jump % 8 == 0 { jump } else { index.wrapping_add(step % 5).wrapping_sub(u32::from(step > 36)) };
            let panel = if seed % 3 == 0 {
                SoftPanel(core::array::from_fn(|led| scramble::split_mix64(seed.wrapping_add(led as u64)) as i8))
            } else {
                SoftPanel::certain(framer.next_panel(), 127)
            };
            deframer.push(index, seed, &panel);
        }
    }
}

#[test]
fn every_length_comes_back_under_the_code_chosen_for_it() {
    let bytes = Noise::new(1).bytes(1024);
    let mut listener = Listener::new();
    for length in 1..=1024 {
        let message = &bytes[..length];
        let mut framer = Framer::new(message, Code::for_length(length), length % 2 == 0).unwrap();
        listener.hear_repeats(&mut framer, 1);
        assert_eq!(listener.messages.len(), length);
        assert_eq!(listener.messages[length - 1], message);
    }
}

#[test]
fn repeats_combine_where_single_ones_fail() {
    let (channel, message, code) = (Channel::Awgn(0.08), Noise::new(2).bytes(100), Code::Tm1280);
    let deliveries = |repeats: u32, alone: bool| {
        let heard = |seed| {
            let mut framer = Framer::new(&message, code, false).unwrap();
            let (mut noise, mut listener) = (Noise::new(seed), Listener::new());
            for _ in 0..repeats {
                for _ in 0..framer.panels_per_repeat() {
                    listener.hear(&channel.read_next(&mut framer, &mut noise));
                }
                if alone && listener.messages.is_empty() {
                    listener = Listener::new();
                }
            }
            assert!(listener.messages.iter().all(|heard| *heard == message));
            listener.messages.len()
        };
        (0..20).map(heard).sum::<usize>()
    };
    let (single, separate, combined) = (deliveries(1, false), deliveries(5, true), deliveries(5, false));
    assert!(single <= 2, "{single} of 20 arrived in one repeat");
    assert!(separate <= 5, "{separate} of 20 arrived in one of five repeats by itself");
    assert!(combined >= 19, "{combined} of 20 arrived in five repeats together");
}

#[test]
fn hard_decisions_combine_too() {
    let (channel, message) = (Channel::Bsc(0.035), Noise::new(11).bytes(128));
    let mut at_once = 0;
    for seed in 0..10 {
        let mut framer = Framer::new(&message, Code::Tm1280, false).unwrap();
        let (mut noise, mut listener) = (Noise::new(seed), Listener::new());
        for number in 0..4 * framer.panels_per_repeat() {
            listener.hear(&channel.read_next(&mut framer, &mut noise));
            if number + 1 == framer.panels_per_repeat() {
                at_once += listener.messages.len();
            }
        }
        assert_eq!(listener.messages, [&message[..]], "seed {seed}");
    }
    assert!(at_once <= 1, "{at_once} of 10 arrived in one repeat");
}

#[test]
fn two_messages_in_sequence_are_delivered_once_each_and_in_one_repeat() {
    for code in Code::ALL {
        let mut listener = Listener::new();
        for (message, fresh) in [(&b"first, of some length"[..], false), (&b"second"[..], true)] {
            listener.hear_repeats(&mut Framer::new(message, code, fresh).unwrap(), 1);
        }
        assert_eq!(listener.messages, [&b"first, of some length"[..], b"second"], "{code}");
    }
}

#[test]
fn the_same_text_is_a_new_message_when_fresh_toggles_or_a_beacon_came_between() {
    let mut listener = Listener::new();
    let message = b"the same text";
    for fresh in [false, false, true] {
        listener.hear_repeats(&mut Framer::new(message, Code::Tc256, fresh).unwrap(), 2);
    }
    assert_eq!(listener.messages.len(), 2);
    listener.hear_repeats(&mut Framer::beacon(), 1);
    listener.hear_repeats(&mut Framer::new(message, Code::Tc256, true).unwrap(), 2);
    assert_eq!(listener.messages.len(), 3);
}

#[test]
fn a_panel_that_says_how_large_it_is_is_heard_in_either_polarity_and_its_message_delivered_once() {
    let geometry = Geometry::new(30_000, Interval::lit("0.75")).unwrap();
    for mut framer in [
        Framer::new(b"a message of two segments", Code::Tc128, false).unwrap(),
        Framer::beacon(),
    ] {
        let mut listener = Listener::new();
        while framer.repeats() < 40 {
            listener.hear_clean(framer.next_panel_of(Some(geometry)));
        }
        assert_eq!(listener.sizes, [geometry; 3]);
        let delivered_once = usize::from(listener.beacons == 0);
        assert_eq!(listener.messages.len(), delivered_once);
        assert_eq!(listener.failed_segments + listener.corrupt, 0);
    }
}

#[test]
fn beacons_are_reported_in_either_polarity() {
    let mut listener = Listener::new();
    listener.hear_repeats(&mut Framer::beacon(), 10);
    assert_eq!(listener.beacons, 10);
    assert!(listener.messages.is_empty());
}

#[test]
fn a_camera_that_is_turned_in_the_middle_of_a_message_costs_it_little() {
    let message: Vec<u8> = (0..200).collect();
    for (from, to) in (0..8).flat_map(|from| (0..8).map(move |to| (from, to))) {
        let [from, to] = [from, to].map(|way: usize| Orientation::ALL[way]);
        let mut framer = Framer::new(&message, Code::Tm1536, true).unwrap();
        let repeat = framer.panels_per_repeat();
        let mut listener = Listener::new();
        for panel in 0..3 * repeat {
            let orientation = if panel < repeat / 2 { from } else { to };
            listener.hear_clean(framer.next_panel().seen(orientation));
        }
        assert_eq!(listener.messages, std::slice::from_ref(&message), "{from}, then {to}");
        assert_eq!(listener.deframer.orientation(), Some(to));
    }
}

#[test]
fn a_lost_sync_or_header_panel_does_not_cost_the_segment() {
    let message = Noise::new(3).bytes(400);
    for lost in 0..3 {
        let mut framer = Framer::new(&message, Code::Tm1280, false).unwrap();
        let mut listener = Listener::new();
        for number in 0..framer.panels_per_repeat() {
            let panel = framer.next_panel();
            let in_segment = number % 23;
            if number >= 23 && in_segment == lost {
                listener.miss()
            } else {
                listener.hear_clean(panel)
            }
        }
        assert_eq!(listener.messages, [&message[..]], "panel {lost} lost");
        // The header's own code may recover a lost header panel: its parity is half of the header.
        assert!(listener.expected_headers > 0, "panel {lost} lost");
    }
}

#[test]
fn a_message_whose_last_panel_is_lost_is_delivered_with_the_panel_after() {
    let message = Noise::new(4).bytes(128);
    let mut framer = Framer::new(&message, Code::Tm1536, false).unwrap();
    let mut listener = Listener::new();
    for number in 0..framer.panels_per_repeat() + 1 {
        let panel = framer.next_panel();
        if number + 1 == framer.panels_per_repeat() {
            listener.miss()
        } else {
            listener.hear_clean(panel)
        }
    }
    assert_eq!(listener.messages, [message]);
}

#[test]
fn a_foreign_header_without_a_payload_does_not_disturb_the_message_in_progress() {
    let message = Noise::new(5).bytes(256);
    let mut framer = Framer::new(&message, Code::Tm1280, false).unwrap();
    let mut foreign = Framer::new(b"something else", Code::Tc256, true).unwrap();
    let mut listener = Listener::new();
    for _ in 0..23 {
        listener.hear_clean(framer.next_panel());
    }
    for _ in 0..3 {
        listener.hear_clean(foreign.next_panel());
    }
    let mut noise = Noise::new(6);
    for _ in 0..4 {
        listener.hear_clean(PanelFrame::from_bits(noise.word()));
    }
    for _ in 0..23 {
        listener.hear_clean(framer.next_panel());
    }
    assert_eq!(listener.messages, [message]);
}

#[test]
fn a_new_message_whose_segments_do_not_decode_takes_over_at_its_second_header() {
    let mut listener = Listener::new();
    listener.hear_repeats(&mut Framer::new(b"old", Code::Tc128, false).unwrap(), 1);
    let message = Noise::new(7).bytes(128);
    let mut framer = Framer::new(&message, Code::Tm1280, true).unwrap();
    let mut noise = Noise::new(8);
    for _ in 0..8 {
        for number in 0..framer.panels_per_repeat() {
            let channel = if number < 3 { Channel::Awgn(0.01) } else { Channel::Awgn(0.08) };
            listener.hear(&channel.read_next(&mut framer, &mut noise));
        }
    }
    assert!(listener.failed_segments >= 2, "{} readings failed", listener.failed_segments);
    assert_eq!(listener.messages, [b"old".to_vec(), message]);
}

#[test]
fn a_message_that_contradicts_its_crc_is_dropped_and_not_delivered() {
    let mut listener = Listener::new();
    let first = Framer::new(&[1; 16], Code::Tc128, false).unwrap();
    let second = Framer::new(&[2; 16], Code::Tc128, false).unwrap();
    // Headers of the first message with payloads of the second.
    let (mut headers, mut payloads) = (first.clone(), second);
    for number in 0..headers.panels_per_repeat() {
        let (header, payload) = (headers.next_panel(), payloads.next_panel());
        listener.hear_clean(if number % 5 < 3 { header } else { payload });
    }
    assert_eq!((listener.corrupt, listener.messages.len()), (1, 0));
    listener.hear_repeats(&mut first.clone(), 1);
    assert_eq!(listener.messages, [[1; 16]]);
}

#[test]
fn random_panels_deliver_nothing() {
    let mut listener = Listener::new();
    let mut noise = Noise::new(9);
    for _ in 0..900_000 {
        listener.hear_clean(PanelFrame::from_bits(noise.word()));
    }
    assert!(listener.messages.is_empty());
    assert!(
        listener.headers + listener.beacons <= 1,
        "{} headers, {} beacons",
        listener.headers,
        listener.beacons
    );
}

/// Transmissions with errors up to the limit of the code, in which one panel in ten is replaced by another: the receiver
/// delivers the sent message or nothing.
#[test]
fn damaged_panels_deliver_nothing_that_was_not_sent() {
    let mut noise = Noise::new(11);
    for round in 0..100u32 {
        let message: Vec<u8> = (0..1 + round * 3).map(|_| noise.word() as u8).collect();
        let mut framer = Framer::new(&message, code((round % 5) as u8), round % 2 == 0).unwrap();
        let channel = Channel::Bsc([0.03, 0.1, 0.2, 0.3, 0.45][round as usize / 5 % 5]);
        let mut listener = Listener::new();
        for _ in 0..1000 {
            let sent = framer.next_panel();
            let shown = if noise.uniform() < 0.1 {
                PanelFrame::from_bits(noise.word())
            } else {
                sent
            };
            listener.hear(&channel.read(shown, &mut noise));
        }
        assert!(
            listener.messages.iter().all(|received| *received == message),
            "round {round} (seed 11)"
        );
    }
}

#[test]
fn headers_are_expected_for_a_while_and_no_longer_after_the_transmitter_fell_silent() {
    let mut framer = Framer::new(b"the last words", Code::Tc256, false).unwrap();
    let mut deframer = Deframer::new();
    for index in 0..framer.panels_per_repeat() {
        deframer.push(index, 0, &SoftPanel::certain(framer.next_panel(), CLEAN));
    }
    let missed = (0..1000).filter(|index| {
        let event = deframer.push(framer.panels_per_repeat() + index, 0, &SoftPanel::ERASED);
        matches!(event, Event::Rejected(Rejection::HeaderMissed { .. }))
    });
    assert_eq!(missed.count(), 8);
}

/// The panels of sync and of a header with these first 7 bytes, in this crate's version.
fn foreign_header(first_bytes: [u8; 7]) -> [PanelFrame; 3] {
    let crc = crc::Crc::<u8>::new(&crc::CRC_8_AUTOSAR).checksum(&first_bytes);
    let mut bytes = [crc; 8];
    bytes[..7].copy_from_slice(&first_bytes);
    let mut coded = link::fec::Block::new(Code::Tc128, 8).encode(&bytes);
    let mut shown = |n| PanelFrame::from_bits(coded.next().unwrap().bits() ^ scramble::word(n));
    [SYNC, shown(1), shown(2)]
}

/// The event of the last of `panels`.
fn last_event(panels: [PanelFrame; 3]) -> Event<'static> {
    let mut deframer = Deframer::new();
    for (index, panel) in (0..2).zip(panels) {
        deframer.push(index, 0, &SoftPanel::certain(panel, CLEAN));
    }
    match deframer.push(2, 0, &SoftPanel::certain(panels[2], CLEAN)) {
        Event::UnsupportedVersion(version) => Event::UnsupportedVersion(version),
        Event::Rejected(why) => Event::Rejected(why),
        event => panic!("{event:?}"),
    }
}

#[test]
fn a_header_of_another_version_is_reported_and_not_read() {
    assert_eq!(last_event(foreign_header([2, 0, 0, 0, 0, 0, 0])), Event::UnsupportedVersion(2));
    let reserved = last_event(foreign_header([1 | 6 << 3, 0, 0, 0, 0, 0, 0]));
    assert!(matches!(reserved, Event::Rejected(Rejection::HeaderInvalid(_))), "{reserved:?}");
}

#[test]
fn what_follows_a_sync_panel_and_is_no_header_is_reported() {
    let mut noise = Noise::new(10);
    let random = [SYNC, PanelFrame::from_bits(noise.word()), PanelFrame::from_bits(noise.word())];
    let event = last_event(random);
    assert!(matches!(event, Event::Rejected(Rejection::HeaderUndecodable(_))), "{event:?}");
}

#[test]
fn a_count_that_begins_anew_is_followed() {
    let message = b"after a restart of the receiver's tracker";
    let mut framer = Framer::new(message, Code::Tc512, false).unwrap();
    let mut deframer = Deframer::new();
    deframer.push(5_000_000, 0, &SoftPanel::ERASED);
    let delivered = (0..framer.panels_per_repeat()).filter(|&index| {
        let panel = SoftPanel::certain(framer.next_panel(), CLEAN);
        matches!(deframer.push(index, 0, &panel), Event::Delivered(_))
    });
    assert_eq!(delivered.count(), 1);
}

#[test]
fn the_count_may_wrap_around() {
    let mut framer = Framer::new(&[9; 64], Code::Tm1280, false).unwrap();
    let mut deframer = Deframer::new();
    let delivered = (0..framer.panels_per_repeat()).filter(|&number| {
        let panel = SoftPanel::certain(framer.next_panel(), CLEAN);
        matches!(deframer.push(number.wrapping_sub(5), 0, &panel), Event::Delivered(_))
    });
    assert_eq!(delivered.count(), 1);
}

#[test]
fn a_header_tells_its_message() {
    let message = b"what the header says";
    let mut framer = Framer::new(message, Code::Tc128, true).unwrap();
    let mut deframer = Deframer::new();
    for index in 0..2 {
        deframer.push(index, 0, &SoftPanel::certain(framer.next_panel(), CLEAN));
    }
    let crc = link::framing::message_crc(message);
    let header = Header {
        code: Code::Tc128,
        length: 20,
        segment: 0,
        fresh: true,
        crc,
    };
    let event = deframer.push(2, 0, &SoftPanel::certain(framer.next_panel(), CLEAN));
    assert_eq!(
        event,
        Event::Header {
            header,
            inverted: false,
            expected: false,
            unsigned: false,
        }
    );
}

#[test]
fn the_deframer_is_as_small_as_documented() {
    assert!(size_of::<Deframer>() <= 37 * 1024, "{} bytes", size_of::<Deframer>());
}

/// Panels of unsigned messages as firmware showed them before there were signatures: receivers of that time read them.
#[test]
fn unsigned_panels_are_as_ever() {
    const CRC_BY_CODE_AND_LENGTH: [[u32; 3]; 5] = [
        [0xfbc1_78bd, 0x4cfd_4de8, 0x8bd1_b269],
        [0xdc48_66c1, 0xc5c0_c108, 0x156d_728e],
        [0x2049_33c6, 0x7110_724c, 0x5f3a_6363],
        [0xd69a_7f82, 0xcb28_ed61, 0xb8cc_630a],
        [0xd641_1fbe, 0x1f77_6fdf, 0xb4ea_60f4],
    ];
    for (value, expected) in (0..).zip(CRC_BY_CODE_AND_LENGTH) {
        let crcs = [1, 48, 200].map(|length: usize| {
            let message: Vec<u8> = (0..length).map(|index| (7 * index + 3) as u8).collect();
            let mut framer = Framer::new(&message, code(value), true).unwrap();
            // A round and its complement.
            let panels = 2 * framer.panels_per_repeat();
            let shown: Vec<u8> = (0..panels).flat_map(|_| framer.next_panel().bits().to_le_bytes()).collect();
            crc32c(&[&shown])
        });
        assert_eq!(crcs, expected, "{:?}", code(value));
    }
}
