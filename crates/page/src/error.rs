//! Why there is no page.

use std::path::PathBuf;

/// What stands in the way of serving the page.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PageError {
    /// The folder is not there, or is none.
    #[error("{}: {why}; give a folder that holds your sites, or one that may", path.display())]
    NoFolder {
        /// As given.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The port is taken.
    #[error(
        "port {port} is in use, perhaps by another `tsumu open`: go on with the page that is open already, or leave out --port"
    )]
    PortTaken {
        /// As given.
        port: u16,
    },
    /// The system does not let us listen.
    #[error("cannot listen on 127.0.0.1: {0}")]
    Listen(std::io::Error),
    /// No room for the page's own files.
    #[error("cannot make a folder for temporary files: {0}")]
    Scratch(std::io::Error),
    /// The server ended by itself.
    #[error("the page's server ended: {0}")]
    Ended(std::io::Error),
}
