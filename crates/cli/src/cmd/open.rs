//! `tsumu open`: the same work in a browser.

use clap::Args;
use page::{Options, PageError, Server};
use serde_json::json;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Error, Job, Result};

/// Open the page: sites, surveys, design, runs and results in the browser, without a command line.
///
/// Serves a page on this machine alone and opens it. FOLDER is a site or holds sites; nothing outside it is read or written, and
/// nothing is sent anywhere. The address holds a secret: whoever knows it may use the page. Ctrl-C, or closing the window, ends it;
/// finished parts of a run are kept.
#[derive(Debug, Args)]
pub struct OpenArgs {
    /// A site folder, or a folder of sites [default: the current folder]
    #[arg(value_name = "FOLDER")]
    pub folder: Option<PathBuf>,
    /// The port [default: 7866, or another that is free]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// Print the address and open nothing
    #[arg(long)]
    pub no_browser: bool,
}

/// Serves until it is told to stop.
pub fn open(args: &OpenArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let program = std::env::current_exe().map_err(Error::failed)?;
    let folder = args.folder.clone().unwrap_or_else(|| PathBuf::from("."));
    let server = Server::bind(&Options { folder, port: args.port, program }).map_err(error)?;
    let address = server.address();
    terminal.emit("open", &json!({ "address": address }));
    terminal.say(format!(
        "Tsumu is open at {address}\nClose it with Ctrl-C. / 終了するには Ctrl-C を押してください。"
    ));
    if !args.no_browser
        && let Err(e) = open::that_detached(&address)
    {
        terminal.say(format!("no browser could be started ({e}); open the address yourself"));
    }
    server.serve(&|| job.is_stopped()).map_err(error)
}

fn error(error: PageError) -> Error {
    match error {
        PageError::NoFolder { .. } | PageError::PortTaken { .. } => Error::bad_input(error),
        other => Error::failed(other),
    }
}
