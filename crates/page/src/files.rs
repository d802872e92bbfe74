//! Files handed out: results to keep, and reports to look at in a box of their own.

use crate::guard::html;
use crate::names::below;
use crate::refusal::{Answer, Refusal};
use axum::body::Body;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::Response;
use std::path::Path;
use tokio_util::io::ReaderStream;

/// A report runs its own script and nothing else: no request, no cookie, no other page.
const REPORT_POLICY: &str = "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";
/// Everything else is only data.
const DATA_POLICY: &str = "sandbox; default-src 'none'";

/// A file as a download.
pub async fn download(root: &Path, path: &str) -> Answer<Response> {
    let mut response = stream(root, path).await?;
    let name = path.rsplit('/').next().unwrap_or_default();
    let headers = response.headers_mut();
    let shown = format!("attachment; filename*=UTF-8''{}", encoded(name));
    let value = HeaderValue::from_str(&shown).map_err(|_| Refusal::gone(path))?;
    headers.insert(header::CONTENT_DISPOSITION, value);
    let kind = HeaderValue::from_static("application/octet-stream");
    headers.insert(header::CONTENT_TYPE, kind);
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(DATA_POLICY));
    Ok(response)
}

/// A report or a picture to look at. What has been taken away in the meantime is said on a page.
pub async fn view(root: &Path, path: &str) -> Answer<Response> {
    let (kind, policy) = match path.rsplit('.').next() {
        Some("html") => ("text/html; charset=utf-8", REPORT_POLICY),
        Some("png") => ("image/png", DATA_POLICY),
        Some("pdf") => ("application/pdf", "default-src 'none'; style-src 'unsafe-inline'"),
        _ => return Err(Refusal::bad("kind-of-file", path)),
    };
    let mut response = match stream(root, path).await {
        Ok(response) => response,
        Err(refusal) if refusal.status == StatusCode::NOT_FOUND => taken_away(),
        Err(refusal) => return Err(refusal),
    };
    let headers = response.headers_mut();
    headers.entry(header::CONTENT_TYPE).or_insert(HeaderValue::from_static(kind));
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(policy));
    Ok(response)
}

fn taken_away() -> Response {
    html(
        StatusCode::NOT_FOUND,
        "<!doctype html><meta charset=utf-8><title>Tsumu</title>\
         <p>This result is not there any more: its folder was moved or deleted. The site itself is as it was.</p>\
         <p lang=ja>この結果はフォルダーが移動または削除されたため、表示できません。現場のデータはそのままです。</p>",
    )
}

async fn stream(root: &Path, path: &str) -> Answer<Response> {
    let place = below(root, path)?;
    if !place.is_file() {
        return Err(Refusal::gone(path));
    }
    let file = tokio::fs::File::open(&place).await.map_err(|_| Refusal::gone(path))?;
    let bytes = file.metadata().await.map_err(|_| Refusal::gone(path))?.len();
    let mut response = Response::new(Body::from_stream(ReaderStream::with_capacity(file, 1 << 16)));
    response.headers_mut().insert(header::CONTENT_LENGTH, HeaderValue::from(bytes));
    Ok(response)
}

/// A name as RFC 5987 has it.
fn encoded(name: &str) -> String {
    let plain = |b: &u8| b.is_ascii_alphanumeric() || b"-._~".contains(b);
    name.bytes()
        .map(|b| if plain(&b) { char::from(b).to_string() } else { format!("%{b:02X}") })
        .collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_name_cannot_break_its_header() {
        assert_eq!(super::encoded("a\"\r\nb; c.csv"), "a%22%0D%0Ab%3B%20c.csv");
        assert_eq!(super::encoded("図.pdf"), "%E5%9B%B3.pdf");
    }
}
