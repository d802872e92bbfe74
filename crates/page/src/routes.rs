//! Which request does what.

use crate::guard::guard;
use crate::names::{below, shown, site_folder};
use crate::order::{Command, Order};
use crate::refusal::{Answer, Refusal};
use crate::server::App;
use crate::{assets, files, sites, upload};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, Path, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::Response;
use axum::routing::{get, post};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::sync::Arc;

/// A form or a review; thousands of decided blocks take some megabytes.
const LARGEST_MESSAGE: usize = 32 << 20;

type Shared = State<Arc<App>>;

pub fn router(app: Arc<App>) -> Router {
    Router::new()
        .route("/", get(|| async { assets::asset("") }))
        .route("/ui/{*name}", get(|Path(name): Path<String>| async move { assets::asset(&name) }))
        .route("/api/state", get(state))
        .route("/api/files", get(all_files))
        .route("/api/site/{site}", get(site).post(save_site))
        .route("/api/site/{site}/review", get(review).post(save_review))
        .route("/api/results/{*place}", get(results))
        .route("/api/jobs", post(begin))
        .route("/api/jobs/{id}/since/{version}", get(news))
        .route("/api/jobs/{id}/stop", post(stop))
        .route("/api/jobs/{id}/map", get(map))
        .route("/api/upload/{name}", post(take).layer(DefaultBodyLimit::disable()))
        .route("/api/may-upload/{name}/{bytes}", get(may_take))
        .route("/download/{*path}", get(download))
        .route("/view/{*path}", get(view))
        .fallback(|| async { Refusal::gone("no such page") })
        .layer(DefaultBodyLimit::max(LARGEST_MESSAGE))
        .layer(from_fn_with_state(Arc::clone(&app), guard))
        .with_state(app)
}

fn json_of(value: &impl serde::Serialize) -> Answer<Response> {
    // Through the program's own writer: an f32 keeps its own digits.
    let value = tsumu::json_value(value).map_err(Refusal::from)?;
    let mut response = Response::new(Body::from(value.to_string()));
    let kind = HeaderValue::from_static("application/json");
    response.headers_mut().insert(header::CONTENT_TYPE, kind);
    Ok(response)
}

fn read<T: DeserializeOwned>(body: &Bytes) -> Answer<T> {
    serde_json::from_slice(body).map_err(|e| Refusal::bad("message", e.to_string()))
}

/// Work on the disk beside the other requests.
async fn aside<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Answer<T> {
    let lost = |_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "system", "the request ended");
    tokio::task::spawn_blocking(work).await.map_err(lost)
}

async fn state(State(app): Shared) -> Answer<Response> {
    if !app.root.is_dir() {
        return Err(Refusal::gone(app.root.display().to_string()));
    }
    let jobs = app.jobs.list();
    let root = app.root.clone();
    let value: Value = aside(move || {
        json!({
            "folder": root.display().to_string(),
            "sites": sites::sites(&root),
            "comparisons": sites::comparisons(&root),
            "blocks": blocks(),
            "free_bytes": upload::free_bytes(&root),
            "jobs": jobs,
            "version": tsumu::version::STAMP,
        })
    })
    .await?;
    json_of(&value)
}

/// Built-in blocks, as `tsumu blocks` lists them.
fn blocks() -> Vec<Value> {
    let all = scene::nominal_blocks();
    let entry = |b: &scene::NominalBlock| {
        json!({ "name": b.name(), "kind": b.kind, "nominal_t": b.tonnes,
                "height_m": b.size_m, "volume_m3": b.volume_m3 })
    };
    all.iter().map(entry).collect()
}

async fn all_files(State(app): Shared) -> Answer<Response> {
    let root = app.root.clone();
    json_of(&aside(move || sites::files(&root)).await?)
}

async fn site(State(app): Shared, Path(site): Path<String>) -> Answer<Response> {
    let folder = site_folder(&app.root, &site)?;
    let root = app.root.clone();
    json_of(&aside(move || sites::site(&root, &folder)).await?)
}

async fn save_site(State(app): Shared, Path(site): Path<String>, body: Bytes) -> Answer<Response> {
    let folder = site_folder(&app.root, &site)?;
    let draft: tsumu::Draft = read(&body)?;
    stays_inside(&app, &folder, &draft)?;
    let revision = aside(move || tsumu::write_draft(&folder, &draft)).await?;
    json_of(&json!({ "revision": revision? }))
}

/// What a form names lies in the opened folder, unless the site named it already: a site written by hand may use a network drive.
fn stays_inside(app: &App, folder: &std::path::Path, draft: &tsumu::Draft) -> Answer<()> {
    let before = tsumu::read_draft(folder).map(|d| d.paths()).unwrap_or_default();
    for path in draft.paths().into_iter().filter(|p| !before.contains(p)) {
        let whole = folder.join(&path).canonicalize();
        let whole = whole.map_err(|_| Refusal::gone(path.display().to_string()))?;
        if !whole.starts_with(&app.root) {
            let shown = path.display().to_string();
            return Err(Refusal::new(StatusCode::FORBIDDEN, "outside", shown));
        }
    }
    Ok(())
}

async fn review(State(app): Shared, Path(site): Path<String>) -> Answer<Response> {
    let folder = site_folder(&app.root, &site)?;
    let text = tokio::fs::read(folder.join("review.json")).await;
    let text = text.map_err(|_| Refusal::gone("review.json"))?;
    json_of(&serde_json::from_slice::<Value>(&text).unwrap_or_default())
}

async fn save_review(
    State(app): Shared,
    Path(site): Path<String>,
    body: Bytes,
) -> Answer<Response> {
    let folder = site_folder(&app.root, &site)?;
    let text = String::from_utf8(body.to_vec());
    let text = text.map_err(|e| Refusal::bad("message", e.to_string()))?;
    aside(move || tsumu::write_review(&folder, &text)).await??;
    json_of(&json!({}))
}

async fn results(State(app): Shared, Path(place): Path<String>) -> Answer<Response> {
    let folder = below(&app.root, &place)?;
    let root = app.root.clone();
    json_of(&aside(move || sites::results(&root, &folder)).await?)
}

async fn begin(State(app): Shared, body: Bytes) -> Answer<Response> {
    let order: Order = read(&body)?;
    let maps = app.scratch.path().to_path_buf();
    let (jobs, root) = (Arc::clone(&app.jobs), app.root.clone());
    let id = jobs.new_id();
    let command =
        aside(move || Command::of(&order, &root, &maps.join(format!("{id}.json")))).await?;
    jobs.begin(id, command?)?;
    json_of(&json!({ "id": id }))
}

#[derive(Deserialize)]
struct Since {
    id: u64,
    version: u64,
}

async fn news(State(app): Shared, Path(since): Path<Since>) -> Answer<Response> {
    json_of(&app.jobs.news(since.id, since.version).await?)
}

async fn stop(State(app): Shared, Path(id): Path<u64>) -> Answer<Response> {
    app.jobs.stop(id)?;
    json_of(&json!({}))
}

async fn map(State(app): Shared, Path(id): Path<u64>) -> Answer<Response> {
    let text = tokio::fs::read(app.scratch.path().join(format!("{id}.json"))).await;
    let mut response = Response::new(Body::from(text.map_err(|_| Refusal::gone("map"))?));
    let kind = HeaderValue::from_static("application/json");
    response.headers_mut().insert(header::CONTENT_TYPE, kind);
    Ok(response)
}

/// Asked before the file is sent: a browser hears no answer while it is sending.
async fn may_take(State(app): Shared, Path(file): Path<(String, u64)>) -> Answer<Response> {
    let place = upload::place(&app.root, &file.0, file.1)?;
    json_of(&json!({ "path": shown(&app.root, &place) }))
}

async fn take(
    State(app): Shared,
    Path(name): Path<String>,
    headers: HeaderMap,
    body: Body,
) -> Answer<Response> {
    let place = upload::store(&app.root, &name, &headers, body).await?;
    json_of(&json!({ "path": shown(&app.root, &place) }))
}

async fn download(State(app): Shared, Path(path): Path<String>) -> Answer<Response> {
    files::download(&app.root, &path).await
}

async fn view(State(app): Shared, Path(path): Path<String>) -> Answer<Response> {
    files::view(&app.root, &path).await
}
