//! Who may ask, and for what.

use crate::asked::serve;
use page::{Options, PageError, Server};

#[test]
fn without_token_cookie_or_host_nothing_is_told() {
    let page = serve("exit 0");
    let port = page.port;
    let host = format!("Host: 127.0.0.1:{port}");
    let cookie = format!("Cookie: tsumu-{port}={}", page.token);
    let get = |lines: &str| page.send(&format!("GET /api/state HTTP/1.1\r\n{lines}"), b"").status;
    assert_eq!(get(&format!("{host}\r\n{cookie}")), 200);
    assert_eq!(get(&host), 403);
    assert_eq!(get(&format!("{host}\r\nCookie: tsumu-{port}={}", "0".repeat(64))), 403);
    // Another name that leads here (DNS rebinding), and the right cookie.
    assert_eq!(get(&format!("Host: evil.example:{port}\r\n{cookie}")), 403);
    assert_eq!(get(&format!("Host: 127.0.0.1:1\r\n{cookie}")), 403);
    let wrong = page.send(&format!("GET /open/{} HTTP/1.1\r\n{host}", "0".repeat(64)), b"");
    assert!(wrong.status == 403 && !wrong.head.contains("set-cookie"));
    let right = page.send(&format!("GET /open/{} HTTP/1.1\r\n{host}", page.token), b"");
    assert_eq!(right.status, 200);
    assert!(right.head.contains("httponly") && right.head.contains("samesite=strict"));
}

#[test]
fn only_the_page_changes_something() {
    let page = serve("exit 0");
    let port = page.port;
    let order = r#"{"kind":"check","site":"pier"}"#;
    let ours = format!("Host: 127.0.0.1:{port}\r\nCookie: tsumu-{port}={}", page.token);
    let post = |lines: &str| {
        let head =
            format!("POST /api/jobs HTTP/1.1\r\n{ours}\r\nContent-Length: {}{lines}", order.len());
        page.send(&head, order.as_bytes()).status
    };
    assert_eq!(post(""), 403, "a form of another site has no header of ours");
    assert_eq!(post("\r\nx-tsumu: page\r\nOrigin: https://evil.example"), 403);
    assert_eq!(post("\r\nx-tsumu: page\r\nSec-Fetch-Site: cross-site"), 403);
    assert_eq!(post(&format!("\r\nx-tsumu: page\r\nOrigin: http://127.0.0.1:{port}")), 200);
    // Nothing changes on GET.
    for path in ["/api/jobs", "/api/jobs/1/stop", "/api/upload/a.laz"] {
        assert_eq!(page.get(path).status, 405, "{path}");
    }
}

#[test]
fn no_path_leads_out_of_the_folder() {
    let page = serve("exit 0");
    for path in [
        "../secret.txt",
        "..%2fsecret.txt",
        "pier/..%2f..%2fsecret.txt",
        "%2e%2e/secret.txt",
        "pier/%2e%2e/%2e%2e/secret.txt",
        "..%5csecret.txt",
        "%2fetc%2fpasswd",
        "pier//../../secret.txt",
        "pier%00",
    ] {
        for kind in ["download", "view", "api/results", "api/site"] {
            let answer = page.get(&format!("/{kind}/{path}"));
            assert!(answer.status >= 400, "{kind}/{path}: {}", answer.status);
            assert!(!answer.body.contains("secret\n") && answer.body != "secret", "{kind}/{path}");
        }
    }
    assert_eq!(page.get("/download/pier/a.xyz").body, "0 0 0\n");
    #[cfg(unix)]
    {
        let link = page.root.join("pier/link.html");
        std::os::unix::fs::symlink(page.outside.path().join("secret.txt"), link).unwrap();
        assert_eq!(page.get("/download/pier/link.html").status, 403);
        assert_eq!(page.get("/view/pier/link.html").status, 403);
    }
}

#[test]
fn a_form_cannot_name_a_file_outside() {
    let page = serve("exit 0");
    let mut draft = page.get("/api/site/pier").json()["draft"].clone();
    draft["site"]["survey"][0]["file"] = "../../secret.txt".into();
    let answer = page.post("/api/site/pier", &draft.to_string());
    assert_eq!((answer.status, answer.error().as_str()), (403, "outside"));
    draft["site"]["survey"][0]["file"] = "a.xyz".into();
    draft["site"]["catalog"] = "../catalog.toml".into();
    assert_eq!(page.post("/api/site/pier", &draft.to_string()).error(), "input");
}

#[test]
fn a_report_is_boxed_and_the_page_runs_its_own_scripts_only() {
    let page = serve("exit 0");
    std::fs::write(page.root.join("pier/report.html"), "<script>1</script>").unwrap();
    let report = page.get("/view/pier/report.html");
    assert!(
        report.head.contains("sandbox allow-scripts") && !report.head.contains("allow-same-origin")
    );
    assert!(page.get("/download/pier/report.html").head.contains("attachment"));
    let own = page.get("/");
    assert!(own.head.contains("script-src 'self'") && own.head.contains("default-src 'none'"));
    assert!(!own.body.contains("<script>") && !own.body.contains(" style="), "inline parts");
    for name in ["main.js", "page.css", "report/style.css", "report/words.js"] {
        assert_eq!(page.get(&format!("/ui/{name}")).status, 200, "{name}");
    }
    assert_eq!(page.get("/ui/nothing.js").status, 404);
    for header in ["x-content-type-options: nosniff", "referrer-policy: no-referrer"] {
        assert!(own.head.contains(header), "{header}");
    }
}

/// Every module that one of ours imports is handed out.
#[test]
fn no_module_is_missing() {
    let page = serve("exit 0");
    let mut open = vec!["/ui/main.js".to_string()];
    let mut seen = Vec::new();
    while let Some(path) = open.pop() {
        let answer = page.get(&path);
        assert_eq!(answer.status, 200, "{path}");
        let folder = path.rsplit_once('/').unwrap().0.to_string();
        for line in answer.body.lines().filter(|l| l.starts_with("import ")) {
            let file = line.rsplit('"').nth(1).unwrap();
            let file =
                file.strip_prefix("./").map_or(file.to_string(), |f| format!("{folder}/{f}"));
            if !seen.contains(&file) {
                open.push(file);
            }
        }
        seen.push(path);
    }
    assert!(seen.len() > 10);
}

#[test]
fn a_second_page_on_the_same_port_is_named() {
    let page = serve("exit 0");
    let options = Options { folder: page.root.clone(), port: Some(page.port), program: "x".into() };
    let error = Server::bind(&options).err().unwrap();
    assert!(matches!(error, PageError::PortTaken { .. }));
    assert!(error.to_string().contains("another `tsumu open`"));
    let nowhere = Options { folder: page.root.join("nothing"), ..options };
    assert!(Server::bind(&nowhere).err().unwrap().to_string().contains("nothing"));
}
