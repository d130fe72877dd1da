//! What happens when the program cannot go on: it starts anew, and says then why.

use core::fmt::{self, Write as _};
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

use cortex_m_rt::ExceptionFrame;
use embassy_rp::pac;

/// What tells a note from what the memory happens to hold after power-up.
const MAGIC: u32 = 0x7ece_1fed;
const NOTE_BYTES: usize = 160;

/// A note to the next start. The watchdog's reset leaves the RAM as it is.
#[derive(Clone, Copy)]
#[repr(C)]
struct Note {
    magic: u32,
    length: u32,
    text: [u8; NOTE_BYTES],
}

#[allow(unsafe_code)]
// SAFETY: the section is in RAM and nobody clears it.
#[unsafe(link_section = ".uninit.note")]
static mut NOTE: MaybeUninit<Note> = MaybeUninit::uninit();

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    end(format_args!("{info}"))
}

/// What the processor cannot do ends here. The stack may be what has no room: it begins anew, as nobody returns.
#[allow(unsafe_code)]
// SAFETY: it takes the place of the vector table's handler, with what the processor kept at the stack's end.
#[unsafe(export_name = "HardFault")]
#[unsafe(naked)]
unsafe extern "C" fn hard_fault() -> ! {
    core::arch::naked_asm!(
        "mrs r0, msp",
        "ldr r1, =_stack_start",
        "msr msp, r1",
        "bl {tell}",
        ".ltorg",
        tell = sym tell_fault,
    )
}

extern "C" fn tell_fault(kept: &ExceptionFrame) -> ! {
    let (at, from) = (kept.pc(), kept.lr());
    end(format_args!(
        "HardFault at {at:#010x}, called from {from:#010x}"
    ))
}

/// Leaves a note, and starts anew.
fn end(why: fmt::Arguments<'_>) -> ! {
    cortex_m::interrupt::disable();
    let mut note = Note {
        magic: MAGIC,
        length: 0,
        text: [0; NOTE_BYTES],
    };
    // What does not fit is cut off.
    let _ = note.write_fmt(why);
    // SAFETY: interrupts are off, and nobody else writes.
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

/// Why the program ended before this start, if it did; told once.
pub fn last_words() -> Option<heapless::String<NOTE_BYTES>> {
    // SAFETY: any bytes are a note of numbers; this runs once, at the start.
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
