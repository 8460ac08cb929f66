//! Threads beside the work, which begin before the work goes on.

use std::io;
use std::sync::mpsc::sync_channel;
use std::thread::{Builder, JoinHandle};

use crate::memory::has_room_for;

/// What must be left beside a stack, bytes: the system and the standard library put a signal stack and a few
/// pages there.
const SPARE_BYTES: usize = 1 << 20;

/// Starts a thread and waits until it runs. While it begins, the standard library asks the system for memory
/// behind the allocator's back, and a refusal there aborts the program. So there must be room before, and
/// nobody else may take it meanwhile.
///
/// # Errors
/// Where there is too little memory, or the system refuses.
pub fn start(
    name: &str,
    stack_bytes: usize,
    work: impl FnOnce() + Send + 'static,
) -> io::Result<JoinHandle<()>> {
    if !has_room_for(stack_bytes + SPARE_BYTES) {
        return Err(io::ErrorKind::OutOfMemory.into());
    }
    let (begun, begins) = sync_channel::<()>(1);
    let run = move || {
        drop(begun);
        work();
    };
    let thread = Builder::new().name(name.to_owned()).stack_size(stack_bytes).spawn(run)?;
    let _ = begins.recv();
    Ok(thread)
}

#[cfg(test)]
mod tests {
    use super::start;
    use std::io::ErrorKind;

    #[test]
    fn a_thread_works_and_one_without_room_is_refused() {
        let (sender, receiver) = std::sync::mpsc::channel();
        let work = move || sender.send(std::thread::current().name().map(str::to_owned)).unwrap();
        start("beside", 256 << 10, work).unwrap().join().unwrap();
        assert_eq!(receiver.recv().unwrap().as_deref(), Some("beside"));
        let refused = start("beside", usize::MAX / 4, || ()).unwrap_err();
        assert_eq!(refused.kind(), ErrorKind::OutOfMemory);
    }
}
