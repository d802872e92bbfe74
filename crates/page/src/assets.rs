//! The page's own files, in the program itself. The modules of the report that it shares are the report's.

use crate::refusal::{Answer, Refusal};
use axum::body::Body;
use axum::http::{HeaderValue, header};
use axum::response::Response;

const OWN: [(&str, &str); 18] = [
    ("", include_str!("../ui/index.html")),
    ("api.js", include_str!("../ui/api.js")),
    ("compare.js", include_str!("../ui/compare.js")),
    ("complaints.js", include_str!("../ui/complaints.js")),
    ("design_form.js", include_str!("../ui/design_form.js")),
    ("form.js", include_str!("../ui/form.js")),
    ("home.js", include_str!("../ui/home.js")),
    ("main.js", include_str!("../ui/main.js")),
    ("map.js", include_str!("../ui/map.js")),
    ("page.css", include_str!("../ui/page.css")),
    ("parts.js", include_str!("../ui/parts.js")),
    ("profile.js", include_str!("../ui/profile.js")),
    ("results.js", include_str!("../ui/results.js")),
    ("site.js", include_str!("../ui/site.js")),
    ("surface.js", include_str!("../ui/surface.js")),
    ("variants.js", include_str!("../ui/variants.js")),
    ("words.js", include_str!("../ui/words.js")),
    ("work.js", include_str!("../ui/work.js")),
];

/// A file of the page by its name.
pub fn asset(name: &str) -> Answer<Response> {
    let text = match name.strip_prefix("report/") {
        Some("style.css") => Some(report::STYLE),
        Some(shared) => find(&report::MODULES, shared),
        None => find(&OWN, name),
    };
    let text = text.ok_or_else(|| Refusal::gone(name))?;
    let mut response = Response::new(Body::from(text));
    let kind = HeaderValue::from_static(match name.rsplit('.').next() {
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        _ => "text/html; charset=utf-8",
    });
    response.headers_mut().insert(header::CONTENT_TYPE, kind);
    Ok(response)
}

fn find(list: &[(&str, &'static str)], name: &str) -> Option<&'static str> {
    list.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}
