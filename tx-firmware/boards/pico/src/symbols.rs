//! Panels to the LEDs at the symbol clock's edges, whatever the processor is busy with.
//!
//! ```text
//! PWM slice 0 ── output B ──────────────────────────▶ latch: the panel shifted last appears on all LEDs
//!      │ wrap, once a symbol
//!      ▼
//! DMA channel 0 ── starts ──▶ DMA channel 1 ── a panel ──▶ SPI 0 ──▶ shift registers
//!                                  ▲    └── interrupt: the processor fills the ring up
//!                             ring of panels in RAM
//! ```
//!
//! A MAX7219 has no latch for all its rows: there a panel appears while it is shifted, in 80 µs.
//!
//! From the ring on everything is hardware: an edge comes when the counter says so, and the panel for the next one is shifted
//! while the present one is shown. Interrupts that are late, or an erasing flash that stops the processor, move no edge as long
//! as the ring holds panels. Another symbol rate begins at an edge, and what is in the ring goes on.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_rp::{
    Peri,
    clocks::clk_sys_freq,
    interrupt::{self, InterruptExt, Priority},
    pac,
    peripherals::{DMA_CH0, DMA_CH1, PWM_SLICE0},
    pwm,
};
use link::symbol_rate::SymbolRate;

use crate::leds::{Entry, Lines, Shifter, TRANSFER};

/// Panels that the ring holds: at the highest symbol rate it outlasts [`STOP_MS`].
const PANELS: usize = 128;
const WORDS: usize = TRANSFER.bytes / 4;
/// log₂ of the ring's bytes, as the DMA controller wants it.
const RING_BITS: u8 = (PANELS * TRANSFER.bytes).ilog2() as u8;

/// Panels that are kept ready: a new message waits for no more, and the processor may be late by as many symbols.
pub const LEAD: usize = 3;
/// The most panels made ready: all but the one in the air.
const LEAD_MAX: usize = PANELS - 2;
/// What the slowest erase of a flash sector takes, 400 ms, and some more.
const STOP_MS: u32 = 410;
const _: () = assert!(lead_before_stop(SymbolRate::MAX) <= LEAD_MAX);

/// The PWM slice that is the symbol clock.
const SLICE: usize = 0;
const TRIGGER: usize = 0;
const SHIFT: usize = 1;

/// The DMA controller wraps its address at the ring's size, so the ring has to be aligned to it.
#[cfg_attr(not(feature = "max7219"), repr(C, align(1024)))]
#[cfg_attr(feature = "max7219", repr(C, align(4096)))]
struct Ring([[AtomicU32; WORDS]; PANELS]);
const _: () = assert!(align_of::<Ring>() == PANELS * TRANSFER.bytes);

static RING: Ring = Ring([const { [const { AtomicU32::new(0) }; WORDS] }; PANELS]);
/// What channel 0 writes to start channel 1. In RAM, since the flash may be erasing.
static SHIFT_STARTER: AtomicU32 = AtomicU32::new(1 << SHIFT);

/// The ring's end that is written to.
pub struct Symbols {
    next: usize,
    rate: SymbolRate,
    /// The rate that begins with the next symbol.
    wanted: Option<SymbolRate>,
    _shifter: Shifter,
    _channels: (Peri<'static, DMA_CH0>, Peri<'static, DMA_CH1>),
}

/// What the symbol clock runs on.
pub struct Hardware {
    pub slice: Peri<'static, PWM_SLICE0>,
    pub leds: Lines,
    pub trigger: Peri<'static, DMA_CH0>,
    pub shift: Peri<'static, DMA_CH1>,
}

impl Symbols {
    /// Starts the symbol clock with a few dark panels.
    pub fn start(hardware: Hardware, rate: SymbolRate, dark: &Entry) -> Self {
        let clock = SymbolClock::for_rate(rate, clk_sys_freq());
        let mut config = pwm::Config::default();
        config.divider = clock.divider.into();
        config.top = clock.top;
        config.enable = false;
        let shifter = hardware.leds.connect(hardware.slice, config);
        pac::SPI0.dmacr().write(|w| w.set_txdmae(true));
        let mut symbols = Self {
            next: 0,
            rate,
            wanted: None,
            _shifter: shifter,
            _channels: (hardware.trigger, hardware.shift),
        };
        for _ in 0..LEAD {
            symbols.push(dark);
        }
        connect_channels();
        pac::PWM.ch(SLICE).csr().modify(|w| w.set_en(true));
        symbols
    }

    /// Another rate, from the next symbol on.
    pub fn set_rate(&mut self, rate: SymbolRate) {
        self.wanted = Some(rate).filter(|rate| *rate != self.rate);
    }

    /// Gives the symbol that has just begun the length that is wanted: to be called when a panel was shifted.
    pub fn begin_wanted_rate(&mut self) {
        if let Some(rate) = self.wanted.take() {
            SymbolClock::for_rate(rate, clk_sys_freq()).take_over();
            self.rate = rate;
        }
    }

    /// Panels to be made ready before the flash stops the processor.
    pub fn lead_before_stop(&self) -> usize {
        // The faster of the two may still be the one that counts.
        lead_before_stop(self.wanted.map_or(self.rate, |wanted| wanted.max(self.rate)))
    }

    /// Puts a panel behind those that wait.
    pub fn push(&mut self, panel: &Entry) {
        put(&RING.0[self.next], panel);
        self.next = (self.next + 1) % PANELS;
    }

    /// Changes the panels that wait.
    #[cfg(feature = "max7219")]
    pub fn amend(&self, change: impl Fn(&mut Entry)) {
        for place in &RING.0 {
            let mut panel = Entry::default();
            for (bytes, word) in panel.chunks_exact_mut(4).zip(place) {
                bytes.copy_from_slice(&word.load(Ordering::Relaxed).to_le_bytes());
            }
            change(&mut panel);
            put(place, &panel);
        }
    }

    /// Whether fewer panels wait than `lead`. A ring that ran empty goes on from where the DMA controller is.
    pub fn is_short_of(&mut self, lead: usize) -> bool {
        let first_unshifted = first_unshifted();
        let waiting = (self.next + PANELS - first_unshifted) % PANELS;
        if waiting > LEAD_MAX {
            self.next = first_unshifted;
            return true;
        }
        waiting < lead
    }
}

fn put(place: &[AtomicU32; WORDS], panel: &Entry) {
    for (word, bytes) in place.iter().zip(panel.chunks_exact(4)) {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        word.store(u32::from_le_bytes(bytes), Ordering::Relaxed);
    }
}

/// Panels shown in [`STOP_MS`], and those that are ready at any time.
const fn lead_before_stop(rate: SymbolRate) -> usize {
    (rate.millihertz() * STOP_MS).div_ceil(1_000_000) as usize + LEAD
}

/// Where in the ring the DMA controller is: it moves on with every symbol.
pub fn position() -> usize {
    first_unshifted()
}

/// The panel that the DMA controller takes next.
fn first_unshifted() -> usize {
    let bytes = pac::DMA.ch(SHIFT).read_addr().read() as usize - RING.0.as_ptr() as usize;
    bytes.div_ceil(TRANSFER.bytes) % PANELS
}

/// Channel 0 waits for the symbol clock and starts channel 1; channel 1 shifts a panel and sends channel 0 waiting again.
fn connect_channels() {
    use pac::dma::{
        regs::CtrlTrig,
        vals::{DataSize, TreqSel},
    };

    let shift = pac::DMA.ch(SHIFT);
    shift.read_addr().write_value(RING.0.as_ptr() as u32);
    shift.write_addr().write_value(pac::SPI0.dr().as_ptr() as u32);
    shift.al2_trans_count().write_value(TRANSFER.count);
    let mut control = CtrlTrig(0);
    control.set_en(true);
    control.set_high_priority(true);
    control.set_data_size(TRANSFER.size);
    control.set_incr_read(true);
    control.set_ring_size(RING_BITS);
    control.set_chain_to(TRIGGER as u8);
    control.set_treq_sel(TreqSel::SPI0_TX);
    shift.al1_ctrl().write_value(control.0);

    let trigger = pac::DMA.ch(TRIGGER);
    trigger.read_addr().write_value(SHIFT_STARTER.as_ptr() as u32);
    trigger.write_addr().write_value(pac::DMA.multi_chan_trigger().as_ptr() as u32);
    trigger.al2_trans_count().write_value(1);
    let mut control = CtrlTrig(0);
    control.set_en(true);
    control.set_high_priority(true);
    control.set_data_size(DataSize::SIZE_WORD);
    control.set_chain_to(TRIGGER as u8);
    control.set_treq_sel(TreqSel::PWM_WRAP0);
    control.set_irq_quiet(true);
    trigger.ctrl_trig().write_value(control);
}

/// No more panels are shifted, whatever state the program is in.
#[cfg(feature = "max7219")]
pub fn force_stop() {
    for channel in [TRIGGER, SHIFT] {
        pac::DMA.ch(channel).al1_ctrl().write_value(0);
    }
}

/// Lets the interrupt come each time a panel was shifted.
pub fn enable_interrupt() {
    pac::DMA.inte(1).write_value(1 << SHIFT);
    interrupt::DMA_IRQ_1.set_priority(Priority::P1);
    #[allow(unsafe_code)]
    // SAFETY: enabled after all that its handler reads is in place, and outside of a critical section.
    unsafe {
        interrupt::DMA_IRQ_1.enable();
    }
}

/// Takes note of the interrupt.
pub fn acknowledge_interrupt() {
    pac::DMA.ints(1).write_value(1 << SHIFT);
}

/// How the system clock is divided down to a symbol.
struct SymbolClock {
    divider: u8,
    top: u16,
}

impl SymbolClock {
    /// The finest division that the 16-bit counter can hold: half a count of 32 768 or more, 15 parts in a million, less than a crystal is
    /// off.
    fn for_rate(rate: SymbolRate, system_hz: u32) -> Self {
        let cycles = u64::from(system_hz) * 1000 / u64::from(rate.millihertz());
        let divider = cycles.div_ceil(1 << 16).clamp(1, 255);
        let counts = (cycles + divider / 2) / divider;
        Self {
            divider: divider as u8,
            top: (counts - 1).min(u16::MAX.into()) as u16,
        }
    }

    /// Puts this division in place of the running one, so that the symbol on show, counted from its beginning, lasts as long as this says.
    /// One that is older than that ends at once.
    fn take_over(&self) {
        let slice = pac::PWM.ch(SLICE);
        let before = u32::from(slice.div().read().int());
        // While the counter stands, a new top counts at once.
        slice.csr().modify(|w| w.set_en(false));
        let shown = u32::from(slice.ctr().read().ctr()) * before / u32::from(self.divider);
        slice.div().write(|w| w.set_int(self.divider));
        slice.top().write(|w| w.set_top(self.top));
        let counter = shown.clamp(1, self.top.into()) as u16;
        slice.ctr().write(|w| w.set_ctr(counter));
        slice.csr().modify(|w| w.set_en(true));
    }
}
