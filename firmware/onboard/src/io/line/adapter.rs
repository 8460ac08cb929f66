//! What only the driver of a serial adapter can be told: to hand bytes on at once, and to forget a divisor of
//! somebody else's.
//!
//! `TIOCGSERIAL` and `TIOCSSERIAL` are the kernel's oldest words for it. A USB adapter of the FTDI family
//! collects bytes for 16 ms unless its low-latency flag is set; 1 ms with it. A custom divisor, as `setserial
//! spd_cust` leaves it, is used whenever 38400 Bd are asked for, so that a laser at 38400 Bd would not be
//! understood.

use std::io;
use std::os::fd::{AsFd, AsRawFd};

/// `ASYNC_SPD_MASK` of the kernel: 38400 Bd stands for another rate.
const SPEED_FLAGS: i32 = 0x1030;
/// `ASYNC_LOW_LATENCY`.
const LOW_LATENCY: i32 = 0x2000;

/// `struct serial_struct` of `linux/serial.h`.
#[repr(C)]
struct SerialStruct {
    kind: i32,
    line: i32,
    port: u32,
    irq: i32,
    flags: i32,
    xmit_fifo_size: i32,
    custom_divisor: i32,
    baud_base: i32,
    close_delay: u16,
    io_type: u8,
    reserved: u8,
    hub6: i32,
    closing_wait: u16,
    closing_wait2: u16,
    iomem_base: *mut u8,
    iomem_reg_shift: u16,
    port_high: u32,
    iomap_base: libc::c_ulong,
}

/// What came of asking.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Adapter {
    /// Bytes are handed on at once.
    Prompt,
    /// The driver does not offer it: reads come as late as the adapter likes.
    AsItIs,
    /// No adapter that could be asked: a pseudo-terminal, a network port.
    None,
}

/// Asks the driver of a port to hand bytes on at once, and clears a custom divisor.
pub(crate) fn prepare(port: impl AsFd) -> Adapter {
    let Ok(mut settings) = get(&port) else { return Adapter::None };
    let wanted = wanted_flags(settings.flags);
    if settings.flags != wanted {
        if settings.flags & SPEED_FLAGS != 0 {
            settings.custom_divisor = 0;
        }
        settings.flags = wanted;
        // Some drivers refuse, some take it and do nothing: what is in force afterwards tells.
        let _ = set(&port, &settings);
    }
    match get(&port) {
        Ok(settings) if settings.flags & LOW_LATENCY != 0 => Adapter::Prompt,
        _ => Adapter::AsItIs,
    }
}

fn wanted_flags(flags: i32) -> i32 {
    (flags & !SPEED_FLAGS) | LOW_LATENCY
}

fn get(port: &impl AsFd) -> io::Result<SerialStruct> {
    // SAFETY: all zeros are a value of the structure: numbers, and a pointer that is never followed.
    let mut settings: SerialStruct = unsafe { std::mem::zeroed() };
    // SAFETY: TIOCGSERIAL fills a `serial_struct`, whose layout this is; `settings` lives through the call.
    let result = unsafe { libc::ioctl(port.as_fd().as_raw_fd(), libc::TIOCGSERIAL, &raw mut settings) };
    if result == 0 { Ok(settings) } else { Err(io::Error::last_os_error()) }
}

fn set(port: &impl AsFd, settings: &SerialStruct) -> io::Result<()> {
    // SAFETY: TIOCSSERIAL reads a `serial_struct`, whose layout this is; `settings` lives through the call.
    let result = unsafe { libc::ioctl(port.as_fd().as_raw_fd(), libc::TIOCSSERIAL, settings) };
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_structure_is_as_large_as_the_kernels() {
        // linux/serial.h on machines of 64 bits.
        if cfg!(target_pointer_width = "64") {
            assert_eq!(size_of::<SerialStruct>(), 72);
            assert_eq!(std::mem::offset_of!(SerialStruct, iomem_base), 48);
        }
    }

    #[test]
    fn a_custom_divisor_goes_and_everything_else_stays() {
        // ASYNC_SPD_CUST = 0x30, ASYNC_SPD_WARP = 0x1010, ASYNC_SKIP_TEST = 0x40.
        for (before, after) in [(0x30, 0x2000), (0x1010, 0x2000), (0x40, 0x2040), (0x2070, 0x2040)] {
            assert_eq!(wanted_flags(before), after);
        }
    }

    #[test]
    fn a_pseudo_terminal_has_no_adapter() {
        let master = rustix::pty::openpt(rustix::pty::OpenptFlags::RDWR).unwrap();
        assert_eq!(prepare(&master), Adapter::None);
    }
}
