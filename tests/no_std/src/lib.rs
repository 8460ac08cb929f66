//! A program without std: it links only if `biplane-wire` and all that it uses do without std and a heap.
#![no_std]

use core::panic::PanicInfo;

/// The checksum of a telegram's bytes.
///
/// # Safety
/// `bytes` points to `length` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn biplane_lms_checksum(bytes: *const u8, length: usize) -> u16 {
    // SAFETY: the caller promises `length` readable bytes at `bytes`.
    biplane_wire::lms::checksum(unsafe { core::slice::from_raw_parts(bytes, length) })
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}
