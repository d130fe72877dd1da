//! The board's UART and timer: Arm's CMSDK APB UART and CMSDK APB timer (Arm DDI 0479, chapters 4.2 and 4.3).

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use tock_registers::interfaces::{Readable, Writeable};
use tock_registers::register_structs;
use tock_registers::registers::{ReadOnly, ReadWrite};

/// Cycles of the system clock in a second, which also drives the timer.
pub const SYSTEM_HZ: u32 = 25_000_000;
const BAUD: u32 = 115_200;

const TIMER_0: usize = 0x4000_0000;
const UART_0: usize = 0x4000_4000;

/// Bits of the UART's state,
const TRANSMIT_FULL: u32 = 1 << 0;
const RECEIVE_FULL: u32 = 1 << 1;
/// of its control,
const TRANSMIT: u32 = 1 << 0;
const RECEIVE: u32 = 1 << 1;
const RECEIVE_INTERRUPT: u32 = 1 << 3;
/// and of its interrupts.
const RECEIVED: u32 = 1 << 1;

register_structs! {
    UartRegisters {
        (0x00 => data: ReadWrite<u32>),
        (0x04 => state: ReadOnly<u32>),
        (0x08 => control: ReadWrite<u32>),
        (0x0c => interrupts: ReadWrite<u32>),
        (0x10 => divider: ReadWrite<u32>),
        (0x14 => @END),
    },
    TimerRegisters {
        (0x00 => control: ReadWrite<u32>),
        (0x04 => value: ReadWrite<u32>),
        (0x08 => reload: ReadWrite<u32>),
        (0x0c => @END),
    }
}

/// The interrupt of a byte received by UART 0. It is never taken: it ends the processor's sleep, no more.
#[derive(Clone, Copy)]
struct Received;

// SAFETY: the number is the one that UART 0 has in all three images, and does not change.
#[allow(unsafe_code)]
unsafe impl InterruptNumber for Received {
    fn number(self) -> u16 {
        0
    }
}

/// UART 0.
pub struct Uart(&'static UartRegisters);

impl Uart {
    /// The UART, sending and receiving.
    pub fn start() -> Self {
        // SAFETY: the registers are there as long as the program runs, and every access to them is volatile.
        #[allow(unsafe_code)]
        let registers = unsafe { &*(UART_0 as *const UartRegisters) };
        registers.divider.set(SYSTEM_HZ / BAUD);
        registers.control.set(TRANSMIT | RECEIVE | RECEIVE_INTERRUPT);
        cortex_m::interrupt::disable();
        // SAFETY: no critical section relies on this interrupt's mask, and it has no handler to begin.
        #[allow(unsafe_code)]
        unsafe {
            NVIC::unmask(Received);
        }
        Self(registers)
    }

    /// Waits for a byte, asleep.
    pub fn read(&self) -> u8 {
        while !self.is_full() {
            self.0.interrupts.set(RECEIVED);
            NVIC::unpend(Received);
            // A byte that came in between is seen here, or makes the interrupt pending, which ends the sleep at once.
            if !self.is_full() {
                cortex_m::asm::wfi();
            }
        }
        self.0.data.get() as u8
    }

    fn is_full(&self) -> bool {
        self.0.state.get() & RECEIVE_FULL != 0
    }

    /// Sends bytes.
    pub fn write(&self, bytes: &[u8]) {
        for &byte in bytes {
            while self.0.state.get() & TRANSMIT_FULL != 0 {}
            self.0.data.set(byte.into());
        }
    }
}

/// Timer 0, which counts cycles of the system clock.
pub struct Clock(&'static TimerRegisters);

impl Clock {
    /// The timer, running.
    pub fn start() -> Self {
        // SAFETY: as for the UART.
        #[allow(unsafe_code)]
        let registers = unsafe { &*(TIMER_0 as *const TimerRegisters) };
        registers.reload.set(u32::MAX);
        registers.value.set(u32::MAX);
        registers.control.set(1);
        Self(registers)
    }

    /// Cycles since the start, modulo 2³².
    pub fn ticks(&self) -> u32 {
        u32::MAX - self.0.value.get()
    }
}
