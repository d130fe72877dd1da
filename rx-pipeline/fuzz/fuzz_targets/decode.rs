//! Decodes any bytes as soft values of panels, through symbols, framing, error correction and signatures. No signature may be proven.
//! `cargo +nightly fuzz run decode` in `rx-pipeline`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use link::framing::{Deframer, Event};
use link::panel::{LEDS, SoftPanel};
use link::signing::{SecretKey, TrustedKey, Verdict, verdict};
use rx_pipeline::symbols::SymbolClock;

fuzz_target!(|data: &[u8]| {
    let [rate, data @ ..] = data else { return };
    let mut clock = SymbolClock::new((f32::from(*rate) + 1.0) / 256.0).expect("a rate from above 0 to 1");
    let mut deframer = Box::new(Deframer::new());
    let owner = SecretKey::from_seed([1; 32]).expect("a key").public();
    let mut trusted = [TrustedKey::new(owner, None)];
    let mut number = 0u64;
    for chunk in data.chunks_exact(LEDS + 1) {
        number = number.wrapping_add(u64::from(chunk[LEDS]));
        let soft = SoftPanel(std::array::from_fn(|led| chunk[led] as i8));
        if let Some(symbol) = clock.push(number, &soft) {
            if let Event::Signed(signed) = deframer.push(symbol.index, symbol.first_frame, &symbol.panel) {
                let verdict = verdict(&mut trusted, signed.message, &signed.signature);
                assert!(matches!(verdict, Verdict::Unknown { .. } | Verdict::Forged { .. }), "{verdict}");
            }
        }
    }
});
