//! Other programs: run, heard, and stopped when they take too long.

use crate::root;
use anyhow::{Context, Result, bail};
use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A program in the repository's folder, with its arguments.
pub fn command<S: AsRef<OsStr>>(program: &str, args: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root()).args(args);
    command
}

/// The cargo that runs us.
pub fn cargo(args: &[&str]) -> Command {
    command(&std::env::var("CARGO").unwrap_or_else(|_| "cargo".into()), args)
}

/// Runs it; an exit status other than 0 is an error that names the command.
pub fn done(mut command: Command) -> Result<()> {
    let words = in_words(&command);
    let status = command.status().with_context(|| format!("starting {words}"))?;
    if !status.success() {
        bail!("{words}: {status}");
    }
    Ok(())
}

/// Whether it runs and ends well, in silence.
pub fn works(mut command: Command) -> bool {
    command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
}

/// What it writes to its standard output; an error if it fails.
pub fn output(mut command: Command) -> Result<String> {
    let words = in_words(&command);
    let output = command.output().with_context(|| format!("starting {words}"))?;
    if !output.status.success() {
        bail!("{words}: {}\n{}", output.status, String::from_utf8_lossy(&output.stderr));
    }
    String::from_utf8(output.stdout).with_context(|| format!("{words} does not write UTF-8"))
}

/// Runs it, showing every line it writes to its standard output and handing it to `hear`; whether it ended well.
pub fn heard(mut command: Command, mut hear: impl FnMut(&str)) -> Result<bool> {
    let words = in_words(&command);
    let mut child =
        command.stdout(Stdio::piped()).spawn().with_context(|| format!("starting {words}"))?;
    let lines = BufReader::new(child.stdout.take().expect("piped just above")).lines();
    for line in lines {
        let line = line.with_context(|| format!("reading what {words} says"))?;
        println!("{line}");
        hear(&line);
    }
    Ok(child.wait()?.success())
}

/// Runs it for at most `limit`.
pub fn done_within(mut command: Command, limit: Duration) -> Result<()> {
    let words = in_words(&command);
    let mut child = command.spawn().with_context(|| format!("starting {words}"))?;
    if waited(&mut child, limit)? {
        return Ok(());
    }
    bail!("{words} failed, or was not done after {} s", limit.as_secs())
}

/// Whether the child ended well in time; one that did not is stopped.
fn waited(child: &mut Child, limit: Duration) -> Result<bool> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status.success());
        }
        if start.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            return Ok(false);
        }
        std::thread::sleep(Duration::from_millis(100));
    }
}

fn in_words(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|w| w.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_too_long_is_stopped() {
        let slow = command("sleep", ["60"]);
        let start = Instant::now();
        assert!(done_within(slow, Duration::from_millis(200)).is_err());
        assert!(start.elapsed() < Duration::from_secs(30));
        assert!(done_within(command("true", [""; 0]), Duration::from_secs(30)).is_ok());
        assert!(done_within(command("false", [""; 0]), Duration::from_secs(30)).is_err());
    }

    #[test]
    fn every_line_is_heard_and_a_failure_is_told() {
        let mut lines = Vec::new();
        let say = command("sh", ["-c", "echo one; echo two; exit 3"]);
        assert!(!heard(say, |line| lines.push(line.to_owned())).unwrap());
        assert_eq!(lines, ["one", "two"]);
    }
}
