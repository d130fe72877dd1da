//! Handles fatal errors: the program restarts and then reports the reason.

use core::fmt::{self, Write as _};
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

use embassy_rp::pac;

/// Marks a valid note, because the memory is random after power-up.
const MAGIC: u32 = 0x7ece_1fed;
const NOTE_BYTES: usize = 160;

/// A note to the next start. A reset by the watchdog preserves the RAM.
#[derive(Clone, Copy)]
#[repr(C)]
struct Note {
    magic: u32,
    length: u32,
    text: [u8; NOTE_BYTES],
}

#[allow(unsafe_code)]
// SAFETY: the section is in RAM, and no startup code clears it.
#[unsafe(link_section = ".uninit.note")]
static mut NOTE: MaybeUninit<Note> = MaybeUninit::uninit();

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    end(format_args!("{info}"))
}

/// Handles a HardFault. The processor pushes eight words onto the stack if there is room; the sixth is the return address, the seventh the
/// address of the fault. If there is no room, the stack has overflowed. The stack pointer is reset, because this function does not return.
#[allow(unsafe_code)]
// SAFETY: the function replaces the handler in the vector table, and reads only within the stack.
#[unsafe(export_name = "HardFault")]
#[unsafe(naked)]
unsafe extern "C" fn hard_fault() -> ! {
    core::arch::naked_asm!(
        "mrs r0, msp",
        "ldr r1, =_stack_end",
        "subs r2, r0, r1",
        "cmp r2, #{room}",
        "blt 1f",
        "ldr r1, [r0, #20]",
        "ldr r0, [r0, #24]",
        "b 2f",
        "1:",
        "movs r0, #0",
        "movs r1, #0",
        "2:",
        "ldr r2, =_stack_start",
        "msr msp, r2",
        "bl {tell}",
        ".ltorg",
        room = const KEPT_BYTES,
        tell = sym tell_fault,
    )
}

/// Maximum size of the frame that the processor pushes, with floating-point registers and alignment.
const KEPT_BYTES: u32 = 112;

extern "C" fn tell_fault(at: u32, from: u32) -> ! {
    match at {
        0 => end(format_args!("the stack overflowed")),
        _ => end(format_args!("HardFault at {at:#010x}, called from {from:#010x}")),
    }
}

/// Leaves a note and restarts.
fn end(why: fmt::Arguments<'_>) -> ! {
    cortex_m::interrupt::disable();
    let mut note = Note {
        magic: MAGIC,
        length: 0,
        text: [0; NOTE_BYTES],
    };
    // Text that does not fit is cut off.
    let _ = note.write_fmt(why);
    // SAFETY: interrupts are off, and no other code writes here.
    #[allow(unsafe_code)]
    unsafe {
        (&raw mut NOTE).write_volatile(MaybeUninit::new(note));
    }
    loop {
        pac::WATCHDOG.ctrl().modify(|w| w.set_trigger(true));
    }
}

impl fmt::Write for Note {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for &byte in text.as_bytes() {
            let place = self.text.get_mut(self.length as usize);
            *place.ok_or(fmt::Error)? = if byte.is_ascii_graphic() { byte } else { b' ' };
            self.length += 1;
        }
        Ok(())
    }
}

/// The reason why the program ended before this start, if it did. Returned once.
pub fn last_words() -> Option<heapless::String<NOTE_BYTES>> {
    // SAFETY: a note of numbers is valid with any bytes, and this runs once, at the start.
    #[allow(unsafe_code)]
    let note = unsafe {
        let note = (&raw const NOTE).read_volatile().assume_init();
        (&raw mut NOTE).write_volatile(MaybeUninit::new(Note { magic: 0, ..note }));
        note
    };
    if note.magic != MAGIC {
        return None;
    }
    let text = note.text.get(..note.length as usize)?;
    heapless::String::from_utf8(heapless::Vec::from_slice(text).ok()?).ok()
}
