//! Measures the depth of the stack.

use cortex_m_rt::STACK_PAINT_VALUE;

/// Maximum depth of the stack since the start, in bytes: everything that differs from the paint applied before `main`.
pub fn deepest_bytes() -> u32 {
    #[allow(unsafe_code)]
    unsafe extern "C" {
        static _stack_start: u32;
        static _stack_end: u32;
    }
    let (top, bottom) = (&raw const _stack_start, &raw const _stack_end);
    // SAFETY: the words between the linker's two symbols are the stack; nothing uses those below its present end.
    #[allow(unsafe_code)]
    let untouched = (bottom.addr()..top.addr())
        .step_by(size_of::<u32>())
        .take_while(|&word| unsafe { (word as *const u32).read_volatile() } == STACK_PAINT_VALUE)
        .count();
    (top.addr() - bottom.addr() - size_of::<u32>() * untouched) as u32
}
