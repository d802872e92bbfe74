//! The server: bound to the loopback address, alive until it is told to stop.

use crate::PageError;
use crate::guard::Key;
use crate::jobs::Jobs;
use crate::routes::router;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tempfile::TempDir;

/// Tried first, so that an address can be kept.
const USUAL_PORT: u16 = 7866;

/// What is served, and where.
#[derive(Clone, Debug)]
pub struct Options {
    /// A site, or a folder of sites; nothing outside it is read or written.
    pub folder: PathBuf,
    /// The port; `None`: the usual one, or any other that is free.
    pub port: Option<u16>,
    /// The program that does the work: its commands are run with `--json`.
    pub program: PathBuf,
}

/// What every request knows.
pub struct App {
    pub root: PathBuf,
    pub key: Key,
    pub jobs: Arc<Jobs>,
    /// Maps of sites and other files that go with the server.
    pub scratch: TempDir,
}

/// A page that is ready to be opened.
pub struct Server {
    listener: TcpListener,
    app: Arc<App>,
}

impl Server {
    /// Takes hold of a port. Errors: the folder is none, the port is taken.
    pub fn bind(options: &Options) -> Result<Self, PageError> {
        let no = |why: String| PageError::NoFolder { path: options.folder.clone(), why };
        let root = options.folder.canonicalize().map_err(|e| no(e.to_string()))?;
        if !root.is_dir() {
            return Err(no("it is a file".into()));
        }
        let listener = listen(options.port)?;
        let port = listener.local_addr().map_err(PageError::Listen)?.port();
        let scratch = tempfile::Builder::new().prefix("tsumu-page-").tempdir();
        let app = App {
            jobs: Arc::new(Jobs::new(options.program.clone(), root.clone())),
            root,
            key: Key::new(port),
            scratch: scratch.map_err(PageError::Scratch)?,
        };
        Ok(Self { listener, app: Arc::new(app) })
    }

    /// The address with its token: whoever knows it may use the page.
    pub fn address(&self) -> String {
        self.app.key.address()
    }

    /// Serves until `stopped` says so; runs that are at work then are ended, their finished parts stay.
    pub fn serve(self, stopped: &dyn Fn() -> bool) -> Result<(), PageError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .map_err(PageError::Listen)?;
        let app = Arc::clone(&self.app);
        let ended = runtime.block_on(async move {
            self.listener.set_nonblocking(true).map_err(PageError::Listen)?;
            let listener =
                tokio::net::TcpListener::from_std(self.listener).map_err(PageError::Listen)?;
            let server = axum::serve(listener, router(self.app)).into_future();
            tokio::select! {
                ended = server => ended.map_err(PageError::Ended),
                () = told(stopped) => Ok(()),
            }
        });
        app.jobs.stop_all();
        runtime.shutdown_timeout(Duration::from_secs(2));
        ended
    }
}

async fn told(stopped: &dyn Fn() -> bool) {
    while !stopped() {
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

fn listen(port: Option<u16>) -> Result<TcpListener, PageError> {
    let on = |port| TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    match port {
        Some(port) => on(port).map_err(|e| match e.kind() {
            std::io::ErrorKind::AddrInUse => PageError::PortTaken { port },
            _ => PageError::Listen(e),
        }),
        None => on(USUAL_PORT).or_else(|_| on(0)).map_err(PageError::Listen),
    }
}
