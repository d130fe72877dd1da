//! Shows panels at the edges of the symbol clock, independent of the processor's load.
//!
//! ```text
//! PWM slice 0 ── output B ──────────────────────────────▶ latch, just before the wrap: what was shifted last appears on all LEDs
//!      │ wrap, once a tick
//!      ▼
//! DMA channel 0 ── which image, starts ──▶ DMA channel 1 ── an image ──▶ SPI 0 ──▶ shift registers
//!      │    ▲                                   ▲
//!      │    └── which panel, starts ── DMA channel 2 ── interrupt: the processor fills the ring up
//!      └─────── after a symbol's ticks ───▶     ▲
//!                              ring of panels in RAM, each with its complement
//! ```
//!
//! A still symbol has one tick. One with a carrier of n cycles has 4·n, and channel 0 cycles through the four images of a cycle:
//! panel, complement, complement, panel ([`tx_firmware::symbol_clock`]).
//!
//! A MAX7219 has no common latch: its panel appears while it is shifted, in 80 µs, and it cannot show a carrier.
//!
//! Everything after the ring is hardware: the counter determines each edge, and the image for the next one is shifted
//! while the current one is shown. Late interrupts, or a flash erase that stops the processor, move no edge as long
//! as the ring holds panels. Another symbol rate begins at an edge, and the panels in the ring stay.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_rp::{
    Peri,
    clocks::clk_sys_freq,
    interrupt::{self, InterruptExt, Priority},
    pac,
    peripherals::{DMA_CH0, DMA_CH1, DMA_CH2, PWM_SLICE0},
    pwm,
};
use link::{symbol_rate::SymbolRate, waveform::SymbolTiming};
use tx_firmware::{
    panel_ring::{PanelOutput, PanelRing, lead_before_stop},
    symbol_clock::{QUARTERS, SymbolClock},
};

use crate::leds::{Entry, IMAGES, Lines, Shifter, TRANSFER};

/// Capacity of the ring in panels: at the highest symbol rate it outlasts [`STOP_MS`].
const PANELS: usize = 128;
const WORDS: usize = TRANSFER.bytes / 4;

/// The slowest erase of a flash sector, 400 ms, with a margin.
pub const STOP_MS: u32 = 410;
const _: () = assert!(lead_before_stop(SymbolRate::MAX, STOP_MS) <= PanelRing::<Symbols>::LEAD_MAX);

/// The PWM slice that is the symbol clock.
const SLICE: usize = 0;
const TRIGGER: usize = 0;
const SHIFT: usize = 1;
const LOAD: usize = 2;
/// EN of a channel's control register.
const CHANNEL_ENABLED: u32 = 1;

/// A panel in the ring. Channel 0 wraps its address at the four addresses, so they have to be aligned to them.
#[repr(C, align(16))]
struct Slot {
    /// The address of the image for each quarter of a cycle. In RAM, because the flash may be erasing.
    quarters: [AtomicU32; QUARTERS.len()],
    /// The panel and, if there is a carrier, its complement.
    images: [[AtomicU32; WORDS]; IMAGES],
}

/// Channel 2 wraps its address likewise.
#[repr(C, align(512))]
struct Order([AtomicU32; PANELS]);
const _: () = assert!(align_of::<Order>() == size_of::<Order>());

static RING: [Slot; PANELS] = [const {
    Slot {
        quarters: [const { AtomicU32::new(0) }; QUARTERS.len()],
        images: [const { [const { AtomicU32::new(0) }; WORDS] }; IMAGES],
    }
}; PANELS];
/// The addresses of the quarters of each panel in the ring.
static ORDER: Order = Order([const { AtomicU32::new(0) }; PANELS]);

/// The symbol clock and its hardware.
pub struct Symbols {
    _shifter: Shifter,
    _channels: (Peri<'static, DMA_CH0>, Peri<'static, DMA_CH1>, Peri<'static, DMA_CH2>),
}

/// The hardware of the symbol clock.
pub struct Hardware {
    pub slice: Peri<'static, PWM_SLICE0>,
    pub leds: Lines,
    pub trigger: Peri<'static, DMA_CH0>,
    pub shift: Peri<'static, DMA_CH1>,
    pub load: Peri<'static, DMA_CH2>,
}

impl Symbols {
    /// Starts the symbol clock with a few dark panels.
    pub fn start(hardware: Hardware, timing: SymbolTiming, dark: &Entry) -> Self {
        let clock = SymbolClock::new(timing, clk_sys_freq());
        let mut config = pwm::Config::default();
        config.divider = clock.divider.into();
        config.top = clock.top;
        // High from the comparison to the wrap.
        config.invert_b = true;
        config.compare_b = clock.latch_from;
        config.enable = false;
        let shifter = hardware.leds.connect(hardware.slice, config);
        pac::SPI0.dmacr().write(|w| w.set_txdmae(true));
        for (slot, order) in RING.iter().zip(&ORDER.0) {
            order.store(slot.quarters.as_ptr() as u32, Ordering::Relaxed);
            for (quarter, is_panel) in slot.quarters.iter().zip(QUARTERS) {
                let image = &slot.images[if is_panel { 0 } else { IMAGES - 1 }];
                quarter.store(image.as_ptr() as u32, Ordering::Relaxed);
            }
            slot.put(dark);
        }
        connect_channels(clock.ticks, 0);
        pac::DMA.multi_chan_trigger().write(|w| w.set_multi_chan_trigger(1 << LOAD));
        pac::PWM.ch(SLICE).csr().modify(|w| w.set_en(true));
        Self {
            _shifter: shifter,
            _channels: (hardware.trigger, hardware.shift, hardware.load),
        }
    }

    /// Stops the clock for some microseconds and restarts it. A still panel has just begun, and starts again with its
    /// carrier; a panel with a carrier is complete but for half a cycle, and the next one begins.
    fn restart(&self, before: SymbolTiming, clock: &SymbolClock) {
        stop_with_the_latch_low();
        wait_until_shifted();
        let back = if before.waveform().is_still() { SHOWN } else { 0 };
        let first = (first_unshifted() + PANELS - back) % PANELS;
        start_anew(clock, first);
    }

    /// Changes the waiting panels.
    #[cfg(feature = "max7219")]
    pub fn amend(&self, change: impl Fn(&mut Entry)) {
        for slot in &RING {
            let mut panel = Entry::default();
            for (bytes, word) in panel.chunks_exact_mut(4).zip(&slot.images[0]) {
                bytes.copy_from_slice(&word.load(Ordering::Relaxed).to_le_bytes());
            }
            change(&mut panel);
            slot.put(&panel);
        }
    }
}

impl PanelOutput for Symbols {
    type Entry = Entry;
    const PLACES: usize = PANELS;

    fn put(&mut self, place: usize, panel: &Entry) {
        RING[place].put(panel);
    }

    /// A panel whose cycles are running is not free.
    fn first_free(&self, timing: SymbolTiming) -> usize {
        (first_unshifted() + usize::from(!timing.waveform().is_still())) % PANELS
    }

    fn begin(&mut self, before: SymbolTiming, timing: SymbolTiming, room: usize) -> bool {
        let clock = SymbolClock::new(timing, clk_sys_freq());
        if before.waveform().is_still() && timing.waveform().is_still() {
            critical_section::with(|_| take_over(&clock));
        } else if room < SHOWN {
            // There is no time to go back in the ring, because the next symbol begins soon.
            return false;
        } else {
            critical_section::with(|_| self.restart(before, &clock));
        }
        true
    }
}

/// Still panels that have been shifted but not completely shown: the current one and the next.
const SHOWN: usize = 2;

impl Slot {
    fn put(&self, panel: &Entry) {
        for (image, flip) in self.images.iter().zip([0, u32::MAX]) {
            for (word, bytes) in image.iter().zip(panel.chunks_exact(4)) {
                let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
                word.store(u32::from_le_bytes(bytes) ^ flip, Ordering::Relaxed);
            }
        }
    }
}

/// The DMA controller's place in the ring, which advances with each symbol.
pub fn position() -> usize {
    first_unshifted()
}

/// The next panel of the DMA controller or, with a carrier, the panel whose cycles it shows.
fn first_unshifted() -> usize {
    let bytes = pac::DMA.ch(LOAD).read_addr().read() as usize - ORDER.0.as_ptr() as usize;
    (bytes / size_of::<AtomicU32>() + PANELS - 1) % PANELS
}

/// Channel 0 waits for the symbol clock, and with each tick gives channel 1 the image to shift. After the ticks of a symbol it starts
/// channel 2, which restarts it at the next panel, from `first` on.
#[inline(never)]
fn connect_channels(ticks: u32, first: usize) {
    use pac::dma::{
        regs::CtrlTrig,
        vals::{DataSize, TreqSel},
    };

    let mut control = CtrlTrig(0);
    control.set_en(true);
    control.set_high_priority(true);
    control.set_incr_read(true);

    let shift = pac::DMA.ch(SHIFT);
    shift.write_addr().write_value(pac::SPI0.dr().as_ptr() as u32);
    shift.al2_trans_count().write_value(TRANSFER.count);
    control.set_data_size(TRANSFER.size);
    control.set_chain_to(SHIFT as u8);
    control.set_treq_sel(TreqSel::SPI0_TX);
    shift.al1_ctrl().write_value(control.0);

    let trigger = pac::DMA.ch(TRIGGER);
    trigger.write_addr().write_value(shift.al3_read_addr_trig().as_ptr() as u32);
    trigger.al2_trans_count().write_value(ticks);
    control.set_data_size(DataSize::SIZE_WORD);
    control.set_chain_to(LOAD as u8);
    control.set_treq_sel(TreqSel::PWM_WRAP0);
    control.set_ring_size(align_of::<Slot>().ilog2() as u8);
    trigger.al1_ctrl().write_value(control.0);

    let load = pac::DMA.ch(LOAD);
    load.read_addr().write_value(ORDER.0[first].as_ptr() as u32);
    load.write_addr().write_value(trigger.al3_read_addr_trig().as_ptr() as u32);
    load.al2_trans_count().write_value(1);
    control.set_chain_to(LOAD as u8);
    control.set_treq_sel(TreqSel::PERMANENT);
    control.set_ring_size(align_of::<Order>().ilog2() as u8);
    load.al1_ctrl().write_value(control.0);
}

/// Stops the channels: no more panels are shifted, in any state of the program.
pub fn force_stop() {
    for channel in [TRIGGER, LOAD, SHIFT] {
        pac::DMA.ch(channel).al1_ctrl().modify(|control| *control &= !CHANNEL_ENABLED);
    }
}

/// Starts the stopped clock at once with a whole symbol of the panel at `first`. Everything that was begun has been shifted.
fn start_anew(clock: &SymbolClock, first: usize) {
    force_stop();
    pac::DMA.chan_abort().write(|w| w.set_chan_abort(1 << TRIGGER));
    // The abort's own bit clears while a transfer is still in flight (erratum RP2040-E13).
    while pac::DMA.ch(TRIGGER).ctrl_trig().read().busy() {}
    connect_channels(clock.ticks, (first + 1) % PANELS);

    // Shift the image of the first tick now.
    let slot = &RING[first];
    pac::DMA.ch(SHIFT).al3_read_addr_trig().write_value(slot.images[0].as_ptr() as u32);
    let trigger = pac::DMA.ch(TRIGGER);
    match clock.ticks {
        1 => pac::DMA.multi_chan_trigger().write(|w| w.set_multi_chan_trigger(1 << LOAD)),
        ticks => {
            trigger.al2_trans_count().write_value(ticks - 1);
            trigger.al3_read_addr_trig().write_value(slot.quarters[1].as_ptr() as u32);
            trigger.al2_trans_count().write_value(ticks);
        }
    }
    wait_until_shifted();
    let slice = pac::PWM.ch(SLICE);
    write_division(clock);
    slice.ctr().write(|w| w.set_ctr(before_latch(clock)));
    slice.csr().modify(|w| w.set_en(true));
}

fn wait_until_shifted() {
    while pac::DMA.ch(SHIFT).ctrl_trig().read().busy() || pac::SPI0.sr().read().bsy() {}
}

/// Enables the interrupt after each loaded symbol.
pub fn enable_interrupt() {
    pac::DMA.inte(1).write_value(1 << LOAD);
    interrupt::DMA_IRQ_1.set_priority(Priority::P1);
    #[allow(unsafe_code)]
    // SAFETY: enabled after everything that its handler reads is initialised, and outside of a critical section.
    unsafe {
        interrupt::DMA_IRQ_1.enable();
    }
}

/// Acknowledges the interrupt.
pub fn acknowledge_interrupt() {
    pac::DMA.ints(1).write_value(1 << LOAD);
}

/// Replaces the division of the running clock, so that the current symbol, counted from its beginning, gets the new duration.
/// A symbol that is older ends at once.
fn take_over(clock: &SymbolClock) {
    let slice = pac::PWM.ch(SLICE);
    let before = u32::from(slice.div().read().int());
    let shown = u32::from(stop_with_the_latch_low()) * before / u32::from(clock.divider);
    write_division(clock);
    let counter = shown.min(before_latch(clock).into()) as u16;
    slice.ctr().write(|w| w.set_ctr(counter));
    slice.csr().modify(|w| w.set_en(true));
}

/// The count after which the latch rises, so that it does not rise while the counter is stopped.
fn before_latch(clock: &SymbolClock) -> u16 {
    clock.latch_from.saturating_sub(1)
}

/// Returns the count.
fn stop_with_the_latch_low() -> u16 {
    let slice = pac::PWM.ch(SLICE);
    slice.csr().modify(|w| w.set_en(false));
    let counter = slice.ctr().read().ctr();
    slice.ctr().write(|w| w.set_ctr(0));
    counter
}

/// While the counter is stopped, all changes take effect at once.
fn write_division(clock: &SymbolClock) {
    let slice = pac::PWM.ch(SLICE);
    slice.div().write(|w| w.set_int(clock.divider));
    slice.top().write(|w| w.set_top(clock.top));
    slice.cc().write(|w| w.set_b(clock.latch_from));
}
