//! How deep the stack has been.

use cortex_m_rt::STACK_PAINT_VALUE;

/// The deepest that the stack has been since the start, in bytes: all that is no more as it was painted before `main`.
pub fn deepest_bytes() -> u32 {
    #[allow(unsafe_code)]
    unsafe extern "C" {
        static _stack_start: u32;
        static _stack_end: u32;
    }
    let (top, bottom) = (&raw const _stack_start, &raw const _stack_end);
    // SAFETY: the words between the linker's two symbols are the stack's; those below what is in use are nobody's.
    #[allow(unsafe_code)]
    let untouched = (bottom.addr()..top.addr())
        .step_by(size_of::<u32>())
        .take_while(|&word| unsafe { (word as *const u32).read_volatile() } == STACK_PAINT_VALUE)
        .count();
    (top.addr() - bottom.addr() - size_of::<u32>() * untouched) as u32
}
