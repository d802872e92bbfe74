//! Files from the browser: whole or not at all, and never more than fits.

use crate::asked::{Served, serve};

fn head(page: &Served, name: &str, stated: &str) -> String {
    let (port, token) = (page.port, &page.token);
    format!(
        "POST /api/upload/{name} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: tsumu-{port}={token}\r\nx-tsumu: page{stated}"
    )
}

fn upload(page: &Served, name: &str, stated: &str, body: &[u8]) -> crate::asked::Answer {
    page.send(&head(page, name, stated), body)
}

fn left(page: &Served) -> Vec<String> {
    let entries = std::fs::read_dir(page.root.join("files")).into_iter().flatten().flatten();
    entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn an_upload_is_stored_under_a_plain_name() {
    let page = serve("exit 0");
    let long = vec![b'7'; 3 << 20];
    let stated = format!("\r\nContent-Length: {}", long.len());
    let answer = upload(&page, "%E6%9D%B1.xyz", &stated, &long);
    assert_eq!(answer.json()["path"], "files/東.xyz", "{}", answer.body);
    assert_eq!(std::fs::read(page.root.join("files/東.xyz")).unwrap(), long);
    let again = upload(&page, "%E6%9D%B1.xyz", "\r\nContent-Length: 1", b"1");
    assert_eq!((again.status, again.error().as_str()), (409, "file-there"));
    let out = upload(&page, "..%2f..%2fa.xyz", "\r\nContent-Length: 1", b"1");
    assert_eq!(out.json()["path"], "files/a.xyz");
    let hostile = upload(&page, "%3Cimg%20src=x%3E%0A.xyz", "\r\nContent-Length: 1", b"1");
    assert_eq!(hostile.json()["path"], "files/_img src=x__.xyz");
}

#[test]
fn what_does_not_fit_is_refused_before_it_is_written() {
    let page = serve("exit 0");
    for (stated, code) in [
        ("\r\nContent-Length: 9000000000000000", "no-room"),
        ("\r\nContent-Length: 60000000000000", "no-room"),
        ("\r\nTransfer-Encoding: chunked", "length"),
    ] {
        let answer = upload(&page, "a.laz", stated, b"0\r\n\r\n");
        assert_eq!(answer.error(), code, "{stated}");
    }
    let asked = |path: &str| page.get(&format!("/api/may-upload/{path}"));
    assert_eq!(asked("a.laz/60000000000000").error(), "no-room");
    assert_eq!(asked("a.exe/1").error(), "kind-of-file");
    assert_eq!(asked("a.laz/1").json()["path"], "files/a.laz");
    assert_eq!(upload(&page, "a.exe", "\r\nContent-Length: 1", b"1").error(), "kind-of-file");
    assert!(left(&page).is_empty());
}

#[test]
fn of_an_upload_that_breaks_off_nothing_stays() {
    let page = serve("exit 0");
    page.send_and_leave(&head(&page, "a.laz", "\r\nContent-Length: 5000000"), b"short");
    // The connection was closed by us: the server notices on its own time.
    for _ in 0..100 {
        if left(&page).is_empty() {
            break;
        }
        std::thread::yield_now();
        std::thread::park_timeout(std::time::Duration::from_millis(20));
    }
    assert!(left(&page).is_empty(), "{:?}", left(&page));
}
