//! `tsumu serve-bin`: stays and answers, one cloud a line.

use crate::cmd::chosen::Chosen;
use anyhow::Context;
use clap::Args;
use std::io::{BufRead, Write};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};
use terminal::Terminal;
use tsumu::{Bin, BinOptions, Error, Job, Result};

/// Stay and answer: one cloud of a bin in, its parts out, that to take first at the front.
///
/// Reads requests from the standard input, one JSON object a line: {"id": 1, "cloud": "shot.ply"} or {"id": 1, "points":
/// [[x, y, z], …]}, in metres, with "sensor_positions" where the camera is not straight above. Writes one line for each:
/// {"id", "parts", "not_judged", "seconds"} or {"id", "error", "kind"}. Ends with its input.
#[derive(Debug, Args)]
pub struct ServeBinArgs {
    /// The types of parts that may lie in the bin
    #[arg(long, value_name = "FILE")]
    pub catalog: PathBuf,
    /// Weights and settings
    #[command(flatten)]
    pub chosen: Chosen,
}

/// Answers until the input ends.
pub fn serve_bin(args: &ServeBinArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let catalog = tsumu::read_catalog(&args.catalog, job)?;
    let options = BinOptions { recognise: args.chosen.options(), settings: args.chosen.settings() };
    let bin = Bin::new(&catalog, &options, job)?;
    terminal.say("ready: one request a line");
    let lines = lines();
    while let Some(line) = next(&lines, job)? {
        if line.trim().is_empty() {
            continue;
        }
        let start = Instant::now();
        let mut answer = bin.answer(&line, job);
        answer["seconds"] = ((start.elapsed().as_secs_f64() * 1e4).round() / 1e4).into();
        let mut out = std::io::stdout().lock();
        let written = writeln!(out, "{answer}").and_then(|()| out.flush());
        written.context("writing an answer").map_err(Error::failed)?;
    }
    Ok(())
}

/// Lines of the standard input; a thread of its own waits for them, so that Ctrl-C ends the program at once.
fn lines() -> Receiver<std::io::Result<String>> {
    let (tell, hear) = sync_channel(1);
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            if tell.send(line).is_err() {
                return;
            }
        }
    });
    hear
}

/// The next request; `None` at the end of the input.
fn next(lines: &Receiver<std::io::Result<String>>, job: &Job) -> Result<Option<String>> {
    loop {
        if job.is_stopped() {
            return Err(Error::stopped(anyhow::anyhow!("stopped")));
        }
        match lines.recv_timeout(Duration::from_millis(50)) {
            Ok(line) => {
                return line.context("reading a request").map(Some).map_err(Error::failed);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
        }
    }
}
