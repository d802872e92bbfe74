//! When memory runs out the system's own library ends the program, with a number and no advice. Here it ends like any other
//! failure: one line, exit status 1, finished parts kept. So do the other faults that end in an abort: a stack that is full, a
//! fault while a fault is told.
//!
//! Nothing may be allocated then, and the thread that aborts must not go on: it hands over through one pipe and waits at
//! another, which is full, while a thread that has been ready since the start says the line and ends the program.

use std::fs::File;
use std::io::{self, PipeReader, PipeWriter, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::sync::mpsc::sync_channel;

/// SIGABRT, on every Unix.
const ABORT: i32 = 6;

const LINE: &str = "tsumu: stopped where it stood: memory ran out, or the program came upon a fault of its own (the line above says which); finished parts are kept: give the same command again with more memory, fewer --threads, or an [area] that is smaller\n";

const EVENT: &str = "{\"code\":1,\"event\":\"failed\",\"message\":\"stopped where it stood: memory ran out, or the program came upon a fault of its own; finished parts are kept\"}\n";

/// Makes an abort end with a line and exit status 1; `json`: the line for machines too. Errors: no pipe, thread or handler
/// could be made, and aborts end as the system ends them.
pub(crate) fn told(json: bool) -> io::Result<()> {
    let (heard, hand_over) = io::pipe()?;
    let (kept_open, wall) = io::pipe()?;
    let out = File::from(io::stdout().as_fd().try_clone_to_owned()?);
    let err = File::from(io::stderr().as_fd().try_clone_to_owned()?);
    let (ready, is_ready) = sync_channel(1);
    let ready = move || {
        let _ = ready.send(());
        say(heard, json.then_some(out), err, kept_open);
    };
    std::thread::Builder::new().name("abort".into()).stack_size(64 << 10).spawn(ready)?;
    // A thread that has no memory to begin with aborts, and would wait for itself if it were asked already.
    is_ready.recv().map_err(io::Error::other)?;
    let wall_too = wall.try_clone()?;
    // In this order they are called.
    signal_hook::low_level::pipe::register(ABORT, hand_over)?;
    signal_hook::low_level::pipe::register(ABORT, wall)?;
    fill(wall_too)
}

/// Writes until nothing more fits; from then on a write waits.
fn fill(wall: PipeWriter) -> io::Result<()> {
    let bytes = [0; 4096];
    for piece in [&bytes[..], &bytes[..1]] {
        // The handler's registration has made the pipe one that does not wait.
        while matches!((&wall).write(piece), Ok(written) if written > 0) {}
    }
    // The call is of sockets in the library, and of every open file in the system.
    UnixStream::from(OwnedFd::from(wall)).set_nonblocking(false)
}

/// Waits for an abort for as long as the program runs.
fn say(mut heard: PipeReader, out: Option<File>, mut err: File, _kept_open: PipeReader) {
    if matches!(heard.read(&mut [0]), Ok(1)) {
        let _ = err.write_all(LINE.as_bytes());
        if let Some(mut out) = out {
            let _ = out.write_all(EVENT.as_bytes());
        }
        signal_hook::low_level::exit(1);
    }
}
