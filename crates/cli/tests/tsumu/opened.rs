//! `tsumu open` as a program: it prints its address, answers there, works with itself as its child, and ends when it is told to.
#![cfg(unix)]

use crate::site::{copy, tsumu};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

struct Opened {
    child: Child,
    host: String,
    token: String,
}

impl Opened {
    fn over(folder: &std::path::Path) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_tsumu"))
            .args(["--json", "open", "--no-browser"])
            .arg(folder)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let said: Value = serde_json::from_str(&line).unwrap();
        let address = said["value"]["address"].as_str().unwrap();
        let rest = address.strip_prefix("http://").unwrap();
        let (host, token) = rest.split_once("/open/").unwrap();
        Self { child, host: host.into(), token: token.into() }
    }

    fn ask(&self, method: &str, path: &str, body: &str) -> Value {
        let port = self.host.split(':').nth(1).unwrap();
        let mut stream = TcpStream::connect(&self.host).unwrap();
        let (host, token, long) = (&self.host, &self.token, body.len());
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\nCookie: tsumu-{port}={token}\r\nx-tsumu: page\r\nConnection: close\r\nContent-Length: {long}\r\n\r\n{body}"
        )
        .unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 200"), "{text}");
        serde_json::from_str(body).unwrap()
    }

    fn ended(&self, order: &str) -> Value {
        let id = self.ask("POST", "/api/jobs", order)["id"].as_u64().unwrap();
        let mut version = 0;
        loop {
            let now = self.ask("GET", &format!("/api/jobs/{id}/since/{version}"), "");
            version = now["version"].as_u64().unwrap();
            if !["waiting", "running"].contains(&now["state"].as_str().unwrap()) {
                return now;
            }
        }
    }
}

impl Drop for Opened {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_site_is_checked_by_the_program_itself() {
    let folder = copy();
    let page = Opened::over(folder.path());
    let state = page.ask("GET", "/api/state", "");
    assert_eq!(state["sites"][0]["id"], "~");
    assert_eq!(state["sites"][0]["name"], "Tiny <site> & test");
    let end = page.ended(r#"{"kind":"check","site":"~"}"#);
    assert_eq!(
        (&end["state"], &end["results"]["check"]["can_be_answered"]),
        (&"done".into(), &true.into())
    );
    let map = page.ask("GET", &format!("/api/jobs/{}/map", end["id"]), "");
    let cells = (map["columns"].as_u64().unwrap() * map["rows"].as_u64().unwrap()) as usize;
    for key in ["survey_m", "design_m"] {
        let known = map[key].as_array().unwrap().iter().filter(|z| z.is_number()).count();
        assert!(map[key].as_array().unwrap().len() == cells && known * 5 > cells, "{key}: {known}");
    }
    // A wrong one is refused with every reason.
    let mut draft = page.ask("GET", "/api/site/~", "")["draft"].clone();
    draft["site"]["crs"] = "EPSG:6677".into();
    draft["site"]["survey_date"] = "soon".into();
    page.ask("POST", "/api/site/~", &draft.to_string());
    let end = page.ended(r#"{"kind":"check","site":"~"}"#);
    assert_eq!(end["state"], "failed");
    assert!(end["results"]["check"]["complaints"].to_string().contains("survey_date"), "{end}");
}

#[test]
fn a_port_that_is_taken_or_a_folder_that_is_none_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let ran = tsumu(&["open", "--no-browser", "--port", &port]);
    assert!(ran.code == 2 && ran.err.contains(&port) && ran.err.contains("--port"), "{}", ran.err);
    let ran = tsumu(&["open", "--no-browser", "no/such/folder"]);
    assert!(ran.code == 2 && ran.err.contains("no/such/folder"), "{}", ran.err);
}
