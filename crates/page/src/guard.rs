//! Who may ask. Any page of any site can send requests to this machine, so the loopback address is no protection by itself: the
//! address holds a random token, which becomes a cookie that other sites' requests do not carry; the request must name this host,
//! and whatever changes something must come from the page itself.

use crate::refusal::Refusal;
use crate::server::App;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// What the page itself may do: its own files and nothing of anybody else.
pub const PAGE_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Header that a form of another site cannot send.
pub const OWN_HEADER: &str = "x-tsumu";

/// The secret of one run of the program.
pub struct Key {
    token: String,
    cookie: String,
    hosts: [String; 2],
}

impl Key {
    pub fn new(port: u16) -> Self {
        let words: [u64; 4] = rand::random();
        let token: String = words.iter().map(|w| format!("{w:016x}")).collect();
        // Cookies do not know ports: two pages on one machine must not overwrite each other's.
        let cookie = format!("tsumu-{port}");
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}"));
        Self { token, cookie, hosts }
    }

    /// The address that opens the page.
    pub fn address(&self) -> String {
        format!("http://{}/open/{}", self.hosts[0], self.token)
    }

    fn names_us(&self, headers: &HeaderMap) -> bool {
        let host = headers.get(header::HOST).and_then(|h| h.to_str().ok());
        host.is_some_and(|host| self.hosts.iter().any(|h| h == host))
    }

    fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let lines = headers.get_all(header::COOKIE).iter().filter_map(|h| h.to_str().ok());
        let mut pairs = lines.flat_map(|l| l.split(';')).filter_map(|p| p.trim().split_once('='));
        pairs.any(|(name, value)| name == self.cookie && same(value, &self.token))
    }

    /// Whether what changes something comes from the page.
    fn is_of_the_page(&self, headers: &HeaderMap) -> bool {
        let text = |name: &str| headers.get(name).map(|h| h.to_str().unwrap_or_default());
        let ours = |o: &str| self.hosts.iter().any(|h| o == format!("http://{h}"));
        text(OWN_HEADER).is_some()
            && text("origin").is_none_or(ours)
            && text("sec-fetch-site").is_none_or(|site| site == "same-origin")
    }

    /// The page that sets the cookie and goes on: the browser sends a strict cookie from here, not across a redirect.
    fn welcome(&self) -> Response {
        let page = "<!doctype html><meta charset=utf-8><title>Tsumu</title><meta http-equiv=refresh content=\"0; url=/\">";
        let mut response = html(StatusCode::OK, page);
        let cookie = format!("{}={}; HttpOnly; SameSite=Strict; Path=/", self.cookie, self.token);
        let value = HeaderValue::from_str(&cookie).expect("hexadecimal digits");
        response.headers_mut().insert(header::SET_COOKIE, value);
        response
    }
}

/// Takes as long whatever is wrong.
fn same(a: &str, b: &str) -> bool {
    let differs = a.bytes().zip(b.bytes()).fold(0, |d, (x, y)| d | (x ^ y));
    a.len() == b.len() && differs == 0
}

/// Lets through what may pass; every answer gets the headers of a page that trusts nobody.
pub async fn guard(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let mut response = match admitted(&app.key, &request) {
        Admitted::Opens => app.key.welcome(),
        Admitted::Asks => next.run(request).await,
        Admitted::Not(refusal) => refusal,
    };
    let headers = response.headers_mut();
    for (name, value) in [
        ("content-security-policy", PAGE_POLICY),
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("cache-control", "no-store"),
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-resource-policy", "same-origin"),
    ] {
        if !headers.contains_key(name) {
            headers.insert(name, HeaderValue::from_static(value));
        }
    }
    response
}

/// What a request may do.
enum Admitted {
    /// It holds the token: it opens the page.
    Opens,
    /// It comes from the page.
    Asks,
    /// Nothing.
    Not(Response),
}

fn admitted(key: &Key, request: &Request) -> Admitted {
    let no = |code, message| {
        Admitted::Not(Refusal::new(StatusCode::FORBIDDEN, code, message).into_response())
    };
    let headers = request.headers();
    if !key.names_us(headers) {
        return no("host", "this host is not served here");
    }
    let reads = matches!(*request.method(), Method::GET | Method::HEAD);
    if let Some(given) = request.uri().path().strip_prefix("/open/").filter(|_| reads) {
        return if same(given, &key.token) { Admitted::Opens } else { Admitted::Not(locked()) };
    }
    if !key.has_cookie(headers) {
        return Admitted::Not(locked());
    }
    if !reads && !key.is_of_the_page(headers) {
        return no("origin", "only the page itself may change something");
    }
    Admitted::Asks
}

/// For people who have come by an old address.
fn locked() -> Response {
    html(
        StatusCode::FORBIDDEN,
        "<!doctype html><meta charset=utf-8><title>Tsumu</title><h1>Tsumu</h1>\
         <p>This address is not complete, or the program was started again since. Open the address that <code>tsumu open</code> has printed.</p>\
         <p lang=ja>アドレスが不完全か、プログラムが再起動されています。<code>tsumu open</code> が表示したアドレスを開いてください。</p>",
    )
}

/// A small page of text without scripts.
pub fn html(status: StatusCode, text: &'static str) -> Response {
    let mut response = Response::new(Body::from(text));
    *response.status_mut() = status;
    let kind = HeaderValue::from_static("text/html; charset=utf-8");
    response.headers_mut().insert(header::CONTENT_TYPE, kind);
    response
}
