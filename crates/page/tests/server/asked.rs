//! A served folder and a client that speaks plain HTTP, so that it can also say what no browser would.

use page::{Options, Server};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use tempfile::TempDir;

pub const SITE: &str = "name = \"Pier <b>\"\ncrs = \"none\"\n[[survey]]\nfile = \"a.xyz\"\n[design]\nkind = \"level\"\nlevel_m = 1.0\nboundary = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]\n";

/// A page over a folder with one site; gone when dropped.
pub struct Served {
    pub root: PathBuf,
    pub port: u16,
    pub token: String,
    pub outside: TempDir,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// An answer.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|_| panic!("no JSON: {}", self.body))
    }

    pub fn error(&self) -> String {
        self.json()["error"].as_str().unwrap_or_default().to_string()
    }
}

/// Serves with a program that is a shell script.
pub fn serve(script: &str) -> Served {
    let outside = tempfile::tempdir().unwrap();
    let program = outside.path().join("program");
    std::fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let folder = outside.path().join("sites");
    std::fs::create_dir_all(folder.join("pier")).unwrap();
    for (name, text) in [
        ("pier/site.toml", SITE),
        ("pier/catalog.toml", "[[block]]\nname = \"t\"\nshape = \"tetrapod 5t\"\n"),
        ("pier/a.xyz", "0 0 0\n"),
        ("../secret.txt", "secret"),
    ] {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let options = Options { folder: folder.clone(), port: None, program };
    // The usual port may be taken by another test: any free one does.
    let server = Server::bind(&options).unwrap();
    let address = server.address();
    let (host, token) = address.strip_prefix("http://127.0.0.1:").unwrap().split_once('/').unwrap();
    let (port, token) = (host.parse().unwrap(), token.strip_prefix("open/").unwrap().to_string());
    let stop = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&stop);
    let thread = std::thread::spawn(move || {
        server.serve(&|| told.load(Ordering::Relaxed)).unwrap();
    });
    let root = folder.canonicalize().unwrap();
    Served { root, port, token, outside, stop, thread: Some(thread) }
}

impl Served {
    /// Sends the lines as they are.
    pub fn send(&self, head: &str, body: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        // A server that has refused may have closed already.
        let _ = stream.write_all(format!("{head}\r\nConnection: close\r\n\r\n").as_bytes());
        let _ = stream.write_all(body);
        let mut bytes = Vec::new();
        let _ = stream.read_to_end(&mut bytes);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or(0);
        Answer { status, head: head.to_lowercase(), body: body.into() }
    }

    /// Sends and goes away without waiting for an answer.
    pub fn send_and_leave(&self, head: &str, body: &[u8]) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.write_all(format!("{head}\r\n\r\n").as_bytes()).unwrap();
        stream.write_all(body).unwrap();
    }

    fn ours(&self) -> String {
        let (port, token) = (self.port, &self.token);
        format!("Host: 127.0.0.1:{port}\r\nCookie: tsumu-{port}={token}")
    }

    pub fn get(&self, path: &str) -> Answer {
        self.send(&format!("GET {path} HTTP/1.1\r\n{}", self.ours()), b"")
    }

    pub fn post(&self, path: &str, body: &str) -> Answer {
        let long = body.len();
        let head = format!(
            "POST {path} HTTP/1.1\r\n{}\r\nx-tsumu: page\r\nContent-Length: {long}",
            self.ours()
        );
        self.send(&head, body.as_bytes())
    }

    /// Waits until a piece of work is over.
    pub fn ended(&self, id: u64) -> Value {
        let mut version = 0;
        loop {
            let now = self.get(&format!("/api/jobs/{id}/since/{version}")).json();
            if !["waiting", "running"].contains(&now["state"].as_str().unwrap()) {
                return now;
            }
            version = now["version"].as_u64().unwrap();
        }
    }

    pub fn begin(&self, order: &str) -> u64 {
        let answer = self.post("/api/jobs", order);
        assert_eq!(answer.status, 200, "{}", answer.body);
        answer.json()["id"].as_u64().unwrap()
    }

    pub fn has(&self, path: &str) -> bool {
        Path::new(&self.root).join(path).exists()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().map(JoinHandle::join);
    }
}
