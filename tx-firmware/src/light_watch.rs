//! Whether the light sensor can be believed: what it reads → what is known of the light.
//!
//! A panel that goes by a broken sensor dazzles at night or vanishes at noon. So each [`Reading`] is evidence for
//! the light or it is none, and light for which there has been no evidence for [`HOLD_MS`] counts as lost:
//!
//! | reading | is evidence |
//! |---|---|
//! | lux, from a register that changed within [`STUCK_MS`] | for that illuminance |
//! | 0 lux | for darkness, however often it comes: a panel that takes it for true is dim, hence safe |
//! | lux, from a register that has not changed for longer | none: *stuck* |
//! | saturated, and within [`CONFIRM_MS`] at the other setting too | for daylight |
//! | saturated, at one setting alone | none: *saturated* |
//! | missing | none: *missing* |
//! | nobody asked the sensor | none: *silent* |
//!
//! ```text
//!               evidence                         no evidence
//!   Unknown ───────────────▶ Measured, Daylight ─────────────▶ Held
//!      │                          ▲        ▲                    │ │
//!      │                          │        └──── evidence ──────┘ │
//!      │ HOLD_MS                  │ evidence, RECOVERY            │ HOLD_MS after
//!      │ after the start          │ times in succession           │ the last evidence
//!      └───────────────────────▶ Lost ◀───────────────────────────┘
//! ```
//!
//! **The stated times.** From the last evidence a sensor that is missing, silent or saturated is found out after
//! [`HOLD_MS`]; one that is stuck after [`STUCK_MS`] + [`HOLD_MS`] from its last change. To this comes the time
//! between two calls of [`LightWatch::watch`].
//!
//! **The other setting.** Steady light gives the same reading again and again, and so does a sensor that hangs.
//! The two are told apart by asking at another setting, an integration time or a range, at which a living
//! sensor's register must differ. [`LightWatch::next_setting`] says when: after a saturated reading, and after
//! [`PROBE_MS`] without a change. A sensor that has one setting only may pass anything that changes with each
//! conversion as its `word`; its saturation is then never confirmed.

use fixed::types::I32F32;
use link::serial::{Faults, Light};

/// How long light counts for which there is no evidence any more, ms.
pub const HOLD_MS: u64 = 2_000;
/// How long a register may stay the same before it is asked for at the other setting, ms.
pub const PROBE_MS: u64 = 1_000;
/// How long a register may stay the same before it is stuck, ms.
pub const STUCK_MS: u64 = 3_000;
/// Within which time a saturated reading is confirmed by one at the other setting, ms.
pub const CONFIRM_MS: u64 = 1_000;
/// After so many readings in succession that are evidence, a lost sensor is believed again.
pub const RECOVERY: u8 = 5;

/// One of two settings of a sensor, integration times or ranges, at which its register differs in the same light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Setting {
    /// The one that suits most light.
    Usual,
    /// Another, less sensitive if there is a choice.
    Other,
}

/// What one attempt to read the light sensor gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// An illuminance.
    Light {
        /// Lux, before the sensor's gain.
        lux: I32F32,
        /// The register it was made from.
        word: u16,
    },
    /// Too much light for this setting.
    Saturated,
    /// No answer, or an error on the bus.
    Missing,
}

/// What a reading is evidence for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// That many lux, before the sensor's gain.
    Light(I32F32),
    /// More light than the sensor can read at either setting.
    Daylight,
    /// Nothing.
    None,
}

/// What is known of the light, and since when.
///
/// ```
/// use fixed::types::I32F32;
/// use link::serial::{Faults, Light};
/// use tx_firmware::light_watch::{Evidence, HOLD_MS, LightWatch, Reading, Setting};
///
/// let mut watch = LightWatch::new();
/// let overcast = Reading::Light { lux: I32F32::lit("5000"), word: 0x7a12 };
/// assert_eq!(watch.observe(100, Setting::Usual, overcast), Evidence::Light(I32F32::lit("5000")));
/// assert_eq!(watch.light(), Light::Measured);
///
/// assert_eq!(watch.observe(200, Setting::Usual, Reading::Missing), Evidence::None);
/// assert_eq!(watch.light(), Light::Held);
/// watch.watch(101 + HOLD_MS);
/// assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_MISSING));
/// ```
#[derive(Clone, Debug)]
pub struct LightWatch {
    light: Light,
    /// When there was evidence last; at first, when the watch began.
    known_ms: u64,
    /// When the sensor was asked last.
    asked_ms: u64,
    /// Why the latest reading was no evidence.
    doubt: Faults,
    /// The latest register, and since when it has been the same.
    word: Option<u16>,
    changed_ms: u64,
    /// When each setting was saturated last, unless it was not since.
    saturated_ms: [Option<u64>; 2],
    next: Setting,
    /// Readings in succession that were evidence, while light is lost.
    recovered: u8,
}

impl LightWatch {
    /// A watch that begins at time 0 and knows nothing.
    pub const fn new() -> Self {
        Self {
            light: Light::Unknown,
            known_ms: 0,
            asked_ms: 0,
            doubt: Faults::NONE,
            word: None,
            changed_ms: 0,
            saturated_ms: [None; 2],
            next: Setting::Usual,
            recovered: 0,
        }
    }

    /// Takes what the sensor gave at `setting`, and returns what is to be made of it: nothing as long as a lost
    /// sensor is not believed again.
    pub fn observe(&mut self, now_ms: u64, setting: Setting, reading: Reading) -> Evidence {
        self.watch(now_ms);
        self.asked_ms = now_ms;
        let evidence = self.weigh(now_ms, setting, reading);
        let light = match evidence {
            Evidence::Light(_) => Light::Measured,
            Evidence::Daylight => Light::Daylight,
            Evidence::None => {
                self.recovered = 0;
                // After one saturated reading nothing is wrong yet: the other setting decides.
                if self.doubt != Faults::SENSOR_SATURATED
                    && matches!(self.light, Light::Measured | Light::Daylight)
                {
                    self.light = Light::Held;
                }
                return Evidence::None;
            }
        };
        if self.light == Light::Lost {
            self.recovered += 1;
            if self.recovered < RECOVERY {
                return Evidence::None;
            }
            self.recovered = 0;
        }
        self.light = light;
        self.known_ms = now_ms;
        self.doubt = Faults::NONE;
        evidence
    }

    /// Lets time pass; to be called often, and not by whoever asks the sensor, who may hang.
    pub fn watch(&mut self, now_ms: u64) {
        if now_ms.saturating_sub(self.asked_ms) > HOLD_MS {
            self.doubt = Faults::SENSOR_SILENT;
            self.recovered = 0;
        }
        if now_ms.saturating_sub(self.known_ms) > HOLD_MS {
            self.light = Light::Lost;
        }
    }

    /// What is known of the light.
    pub const fn light(&self) -> Light {
        self.light
    }

    /// Why light is held or lost; none while it is known.
    pub const fn faults(&self) -> Faults {
        match self.light {
            Light::Held | Light::Lost => self.doubt,
            Light::Unknown | Light::Measured | Light::Daylight => Faults::NONE,
        }
    }

    /// The setting at which the sensor is to be asked next.
    pub const fn next_setting(&self) -> Setting {
        self.next
    }

    fn weigh(&mut self, now_ms: u64, setting: Setting, reading: Reading) -> Evidence {
        let since = |then_ms: u64| now_ms.saturating_sub(then_ms);
        let (this, other, opposite) = match setting {
            Setting::Usual => (0, 1, Setting::Other),
            Setting::Other => (1, 0, Setting::Usual),
        };
        self.saturated_ms[this] = (reading == Reading::Saturated).then_some(now_ms);
        self.next = Setting::Usual;
        match reading {
            Reading::Missing => self.none(Faults::SENSOR_MISSING),
            Reading::Saturated => {
                self.next = opposite;
                match self.saturated_ms[other] {
                    Some(then_ms) if since(then_ms) <= CONFIRM_MS => Evidence::Daylight,
                    _ => self.none(Faults::SENSOR_SATURATED),
                }
            }
            Reading::Light { lux, word } => {
                if self.word != Some(word) {
                    (self.word, self.changed_ms) = (Some(word), now_ms);
                }
                if since(self.changed_ms) >= PROBE_MS {
                    self.next = opposite;
                }
                if lux <= I32F32::ZERO || since(self.changed_ms) <= STUCK_MS {
                    Evidence::Light(lux)
                } else {
                    self.none(Faults::SENSOR_STUCK)
                }
            }
        }
    }

    const fn none(&mut self, doubt: Faults) -> Evidence {
        self.doubt = doubt;
        Evidence::None
    }
}

impl Default for LightWatch {
    fn default() -> Self {
        Self::new()
    }
}
