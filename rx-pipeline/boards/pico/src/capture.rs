//! Captures frames from the camera's pins to memory without the processor: a PIO state machine waits for clocks and samples the pins, and
//! DMA stores the samples.
//!
//! There is room for two frames. One is captured while the other is read; if both are in use, frames are dropped.

use embassy_futures::poll_once;
use embassy_rp::{
    Peri, bind_interrupts, dma,
    peripherals::{DMA_CH0, PIN_6, PIN_7, PIN_8, PIN_9, PIN_10, PIN_11, PIN_12, PIN_13, PIN_14, PIN_15, PIN_16, PIO0},
    pio::{
        Config, Direction, FifoJoin, InterruptHandler, Irq, IrqFlags, LoadedProgram, Pio, ShiftConfig, ShiftDirection, StateMachine,
        program::pio_asm,
    },
};
use embassy_sync::{
    blocking_mutex::raw::CriticalSectionRawMutex,
    zerocopy_channel::{Channel, Receiver, Sender},
};
use embassy_time::{Duration, Instant, with_timeout};
use portable_atomic::{AtomicU32, Ordering};
use rx_pipeline::{hm01b0::Mode, standalone::CameraMode};
use static_cell::{ConstStaticCell, StaticCell};

/// The mode that the camera is set to.
pub const MODE: Mode = if cfg!(feature = "rp2040") { Mode::BINNED } else { Mode::QVGA };
/// The properties of that mode that the receiver must know.
pub const CAMERA_MODE: CameraMode = MODE.camera_mode();
const WORDS: usize = CAMERA_MODE.width * CAMERA_MODE.height / 4;
/// The time limit of a frame.
const PATIENCE: Duration = Duration::from_micros(3 * CAMERA_MODE.period_us() as u64);

bind_interrupts!(struct Irqs {
    PIO0_IRQ_0 => InterruptHandler<PIO0>;
    DMA_IRQ_0 => dma::InterruptHandler<DMA_CH0>;
});

/// A captured frame.
pub struct Shot {
    words: [u32; WORDS],
    /// The end of its last line's readout.
    pub ended: Instant,
}

impl Shot {
    const EMPTY: Self = Self {
        words: [0; WORDS],
        ended: Instant::from_ticks(0),
    };

    /// Its grey levels, row by row.
    pub fn pixels(&self) -> &[u8] {
        let (words, bytes) = (self.words.as_ptr(), size_of_val(&self.words));
        // SAFETY: any four bytes are grey levels, and bytes need no alignment.
        #[allow(unsafe_code)]
        unsafe {
            core::slice::from_raw_parts(words.cast(), bytes)
        }
    }
}

pub type Shots = Receiver<'static, CriticalSectionRawMutex, Shot>;
type Film = Sender<'static, CriticalSectionRawMutex, Shot>;

/// Number of frames that ended before all their lines.
static CUT_SHORT: AtomicU32 = AtomicU32::new(0);

/// Number of frames that ended before all their lines.
pub fn cut_short() -> u32 {
    CUT_SHORT.load(Ordering::Relaxed)
}

/// The pins, and the peripherals that move their levels to memory.
pub struct Wires {
    pub pio: Peri<'static, PIO0>,
    pub dma: Peri<'static, DMA_CH0>,
    pub data: (
        Peri<'static, PIN_6>,
        Peri<'static, PIN_7>,
        Peri<'static, PIN_8>,
        Peri<'static, PIN_9>,
        Peri<'static, PIN_10>,
        Peri<'static, PIN_11>,
        Peri<'static, PIN_12>,
        Peri<'static, PIN_13>,
    ),
    pub pixel_clock: Peri<'static, PIN_14>,
    pub line_valid: Peri<'static, PIN_15>,
    pub frame_valid: Peri<'static, PIN_16>,
}

/// Captures frames.
pub struct Capture {
    machine: StateMachine<'static, PIO0, 0>,
    program: LoadedProgram<'static, PIO0>,
    ended: Irq<'static, PIO0, 0>,
    flags: IrqFlags<'static, PIO0>,
    dma: dma::Channel<'static>,
    film: Film,
}

impl Capture {
    /// A capture that has not started, and the receiving end of its frames.
    pub fn new(wires: Wires) -> (Self, Shots) {
        static FRAMES: ConstStaticCell<[Shot; 2]> = ConstStaticCell::new([const { Shot::EMPTY }; 2]);
        static CHANNEL: StaticCell<Channel<'static, CriticalSectionRawMutex, Shot>> = StaticCell::new();
        let channel = CHANNEL.init_with(|| Channel::new(FRAMES.take()));
        let (film, shots) = channel.split();

        let Pio {
            mut common,
            mut sm0,
            irq0,
            irq_flags,
            ..
        } = Pio::new(wires.pio, Irqs);
        let (d0, d1, d2, d3, d4, d5, d6, d7) = wires.data;
        let data = [
            common.make_pio_pin(d0),
            common.make_pio_pin(d1),
            common.make_pio_pin(d2),
            common.make_pio_pin(d3),
            common.make_pio_pin(d4),
            common.make_pio_pin(d5),
            common.make_pio_pin(d6),
            common.make_pio_pin(d7),
        ];
        let clock = common.make_pio_pin(wires.pixel_clock);
        let line = common.make_pio_pin(wires.line_valid);
        let frame = common.make_pio_pin(wires.frame_valid);
        // X counts the pixels of a line, Y holds their number minus one. A frame that is cut short ends when its frame-valid line falls,
        // with the same interrupt as a complete one.
        let assembled = pio_asm!(
            "    pull block",
            "    out y, 32",
            ".wrap_target",
            "    wait 0 gpio 16",
            "    wait 1 gpio 16",
            "between:",
            "    jmp pin line",
            "    mov osr, pins",
            "    out null, 10",
            "    out x, 1",
            "    jmp x-- between",
            "    irq set 0",
            ".wrap",
            "line:",
            "    mov x, y",
            "pixel:",
            "    wait 1 gpio 14",
            "    in pins, 8",
            "    wait 0 gpio 14",
            "    jmp x-- pixel",
            "    wait 0 gpio 15",
            "    jmp between",
        );
        let program = common.load_program(&assembled.program);
        // The pins in order, data first: a sample has these eight, and the test for the end of a frame reads all of them.
        let [d0, d1, d2, d3, d4, d5, d6, d7] = &data;
        let inputs = [d0, d1, d2, d3, d4, d5, d6, d7, &clock, &line, &frame];
        sm0.set_pin_dirs(Direction::In, &inputs);
        let mut config = Config::default();
        config.use_program(&program, &[]);
        config.set_in_pins(&inputs);
        config.set_jmp_pin(&line);
        config.fifo_join = FifoJoin::Duplex;
        config.shift_in = ShiftConfig {
            auto_fill: true,
            threshold: 32,
            direction: ShiftDirection::Right,
        };
        config.shift_out = ShiftConfig {
            auto_fill: false,
            threshold: 32,
            direction: ShiftDirection::Right,
        };
        sm0.set_config(&config);
        let capture = Self {
            machine: sm0,
            program,
            ended: irq0,
            flags: irq_flags,
            dma: dma::Channel::new(wires.dma, Irqs),
            film,
        };
        (capture, shots)
    }

    /// Captures one frame after another.
    pub async fn run(&mut self) -> ! {
        loop {
            let machine = &mut self.machine;
            // Stopped before the wait for room: otherwise, pixels of a dropped frame would become the first pixels of the next.
            machine.set_enable(false);
            let shot = self.film.send().await;
            machine.clear_fifos();
            while machine.rx().try_pull().is_some() {}
            machine.restart();
            self.flags.clear(0);
            // SAFETY: the machine is stopped, and this is the start of its program.
            #[allow(unsafe_code)]
            unsafe {
                machine.exec_jmp(self.program.origin);
            }
            machine.tx().push(CAMERA_MODE.width as u32 - 1);
            // The machine waits for the next frame first, and its FIFO holds a few pixels until the transfer starts.
            machine.set_enable(true);
            let mut transfer = machine.rx().dma_pull(&mut self.dma, &mut shot.words, false);
            let ended = with_timeout(PATIENCE, self.ended.wait()).await;
            let is_whole = poll_once(&mut transfer).is_ready();
            drop(transfer);
            match (ended, is_whole) {
                (Ok(()), true) => {
                    shot.ended = Instant::now();
                    self.film.send_done();
                }
                (Ok(()), false) => {
                    CUT_SHORT.add(1, Ordering::Relaxed);
                }
                // No frame ended, or it did not end at the expected place: wait for the next one.
                (Err(_), _) => {}
            }
        }
    }
}
