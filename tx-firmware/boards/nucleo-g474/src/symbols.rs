//! Shows panels at the edges of the symbol clock, independent of the processor's load.
//!
//! ```text
//! LPTIM1 ── output ──────────────────────────────▶ latch, high before the end of a symbol: what was shifted last appears on all LEDs
//!    │         │ falling edge
//!    │         ▼
//!    │      DMAMUX lets 8 requests of SPI 1 pass ──▶ DMA channel 1 ── a panel ──▶ SPI 1 ──▶ shift registers
//!    │                                                    ▲
//!    └── interrupt: the processor fills the ring up ──▶ ring of panels in RAM
//! ```
//!
//! SPI 1 requests bytes continuously. Eight requests reach the DMA controller after each falling edge of the latch, and
//! the DMA controller cycles through the ring. So everything after the ring is hardware.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::{
    Peri,
    gpio::{Level, Output as Pin, Speed},
    interrupt::{self, InterruptExt, Priority},
    lptim::{
        pwm::{Output, PwmPin},
        timer::Timer,
    },
    mode::Blocking,
    pac,
    peripherals::{DMA1_CH1, LPTIM1, PA5, PA7, PC1, SPI1},
    rcc,
    spi::{self, Spi, mode::Master},
    time::Hertz,
};
use link::waveform::SymbolTiming;
use tx_firmware::{panel_ring::PanelOutput, symbol_clock::SymbolClock};

/// Capacity of the ring in panels.
const PANELS: usize = 32;
/// Bytes of a panel, one for each shift register.
const BYTES: usize = 8;
/// Flying leads can carry this. The nearest rate of the SPI's divider is 2.7 MHz, and a panel takes 24 µs.
const SHIFT_CLOCK: Hertz = Hertz(4_000_000);

/// A microsecond; a 74HC595 needs a pulse of 0.1 µs.
const LATCH_CYCLES: u32 = 170;

/// The clock stops sooner: in 0.7 µs at the highest rate.
const COUNTS_TO_STOP: u16 = 8;

/// RM0440, "DMAMUX: assignment of multiplexer inputs to resources".
const SPI1_TX: u8 = 11;
/// RM0440, "DMAMUX: assignment of synchronization inputs to resources".
const LPTIM1_OUT: u8 = 20;
/// DMA 1, channel 1, and its multiplexer.
const CHANNEL: usize = 0;

static RING: [[AtomicU32; BYTES / 4]; PANELS] = [const { [const { AtomicU32::new(0) }; BYTES / 4] }; PANELS];

/// The symbol clock and its hardware.
pub struct Symbols {
    clock: SymbolClock,
    _timer: Timer<'static, LPTIM1>,
    _latch: PwmPin<'static, LPTIM1, Output>,
    _spi: Spi<'static, Blocking, Master>,
    _channel: Peri<'static, DMA1_CH1>,
}

/// The hardware of the symbol clock.
pub struct Hardware {
    pub timer: Peri<'static, LPTIM1>,
    pub latch: Peri<'static, PC1>,
    pub spi: Peri<'static, SPI1>,
    pub clock: Peri<'static, PA5>,
    pub data: Peri<'static, PA7>,
    pub channel: Peri<'static, DMA1_CH1>,
}

impl Symbols {
    /// Starts the symbol clock with a ring of this panel.
    pub fn start(mut hardware: Hardware, timing: SymbolTiming, dark: &[u8; BYTES]) -> Self {
        let mut config = spi::Config::default();
        config.frequency = SHIFT_CLOCK;
        let mut spi = Spi::new_blocking_txonly(hardware.spi, hardware.clock, hardware.data, config);
        latch_now(&mut spi, hardware.latch.reborrow(), dark);
        let mut symbols = Self {
            clock: clock(timing),
            _spi: spi,
            _timer: Timer::new(hardware.timer),
            _latch: PwmPin::new(hardware.latch),
            _channel: hardware.channel,
        };
        (0..PANELS).for_each(|place| symbols.put(place, dark));
        connect_channel();
        symbols.run();
        symbols
    }

    /// Starts a whole symbol.
    fn run(&self) {
        let timer = pac::LPTIM1;
        timer.cr().write(|w| w.set_enable(false));
        timer
            .cfgr()
            .write(|w| w.set_presc(pac::lptim::vals::Presc::from_bits(self.clock.divider.ilog2() as u8)));
        timer.ier().write(|w| w.set_arrmie(true));
        timer.cr().write(|w| w.set_enable(true));
        // It is enabled after two counts.
        let processor_clocks = rcc::frequency::<SPI1>().0 / rcc::frequency::<LPTIM1>().0;
        cortex_m::asm::delay(3 * u32::from(self.clock.divider) * processor_clocks);
        timer.arr().write(|w| w.set_arr(self.clock.top));
        timer.cmp().write(|w| w.set_cmp(self.latch_after()));
        while !(timer.isr().read().arrok() && timer.isr().read().cmpok(0)) {}
        timer.icr().write(|w| {
            w.set_arrokcf(true);
            w.set_cmpokcf(0, true);
        });
        timer.cr().write(|w| {
            w.set_enable(true);
            w.set_cntstrt(true);
        });
    }

    /// The latch is high after this count, until the last one begins or ends: two counts earlier than the clock requires, so that it is
    /// high for a whole count in either case.
    fn latch_after(&self) -> u16 {
        self.clock.latch_from.saturating_sub(2)
    }
}

impl PanelOutput for Symbols {
    type Entry = [u8; BYTES];
    const PLACES: usize = PANELS;

    fn put(&mut self, place: usize, panel: &[u8; BYTES]) {
        for (word, bytes) in RING[place].iter().zip(panel.chunks_exact(4)) {
            word.store(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]), Ordering::Relaxed);
        }
    }

    fn first_free(&self, _: SymbolTiming) -> usize {
        position()
    }

    /// The current symbol lasts longer by the time since its beginning, that of an interrupt.
    fn begin(&mut self, _: SymbolTiming, timing: SymbolTiming, _: usize) -> bool {
        // A clock that stops while the latch is high would shift a panel that is never latched. The interrupt comes as the last count
        // begins, so this waits for at most 35 µs.
        while count() >= self.latch_after().saturating_sub(COUNTS_TO_STOP) {}
        self.clock = clock(timing);
        self.run();
        true
    }
}

/// Shows a panel before the symbol clock runs. The clock latches its first panel after two symbols, which at slow rates is later than the
/// first reading of the light: until then the LEDs would show the registers' arbitrary contents at power-up.
fn latch_now(spi: &mut Spi<'static, Blocking, Master>, latch: Peri<'_, PC1>, panel: &[u8; BYTES]) {
    let mut latch = Pin::new(latch, Level::Low, Speed::Low);
    // It cannot fail, because there is no receiver to overrun.
    let _ = spi.blocking_write(panel);
    latch.set_high();
    cortex_m::asm::delay(LATCH_CYCLES);
    latch.set_low();
}

fn clock(timing: SymbolTiming) -> SymbolClock {
    SymbolClock::with_power_of_two(timing, rcc::frequency::<LPTIM1>().0)
}

/// The symbol clock's position in a symbol. A count is valid only if two reads agree.
fn count() -> u16 {
    let read = || pac::LPTIM1.cnt().read().cnt();
    let mut before = read();
    loop {
        let now = read();
        if now == before {
            return now;
        }
        before = now;
    }
}

/// The place in the ring after the last started panel.
pub fn position() -> usize {
    let left = usize::from(pac::DMA1.ch(CHANNEL).ndtr().read().ndt());
    (PANELS * BYTES).saturating_sub(left).div_ceil(BYTES) % PANELS
}

/// Cycles through the ring, eight bytes for each falling edge of the latch.
fn connect_channel() {
    use pac::bdma::vals::{Dir, Pl, Size};
    use pac::dmamux::vals::Pol;

    pac::DMAMUX1.ccr(CHANNEL).write(|w| {
        w.set_dmareq_id(SPI1_TX);
        w.set_sync_id(LPTIM1_OUT);
        w.set_spol(Pol::FALLING_EDGE);
        w.set_nbreq(BYTES as u8 - 1);
        w.set_se(true);
    });
    let channel = pac::DMA1.ch(CHANNEL);
    channel.par().write_value(pac::SPI1.dr16().as_ptr() as u32);
    channel.mar().write_value(RING.as_ptr() as u32);
    channel.ndtr().write(|w| w.set_ndt((PANELS * BYTES) as u16));
    channel.cr().write(|w| {
        w.set_dir(Dir::FROM_MEMORY);
        w.set_circ(true);
        w.set_minc(true);
        w.set_psize(Size::BITS8);
        w.set_msize(Size::BITS8);
        w.set_pl(Pl::VERY_HIGH);
        w.set_en(true);
    });
    pac::SPI1.cr2().modify(|w| w.set_txdmaen(true));
}

/// Enables the interrupt at the beginning of each symbol.
pub fn enable_interrupt() {
    interrupt::LPTIM1.set_priority(Priority::P1);
    #[allow(unsafe_code)]
    // SAFETY: enabled after everything that its handler reads is initialised, and outside of a critical section.
    unsafe {
        interrupt::LPTIM1.enable();
    }
}

/// Acknowledges the interrupt.
pub fn acknowledge_interrupt() {
    pac::LPTIM1.icr().write(|w| w.set_arrmcf(true));
}
