//! A file from the browser: straight to disk under a temporary name, refused before the disk is full, renamed when it is whole.

use crate::names::made_plain;
use crate::refusal::{Answer, Refusal};
use axum::body::Body;
use axum::http::{HeaderMap, StatusCode, header};
use futures_util::StreamExt;
use std::path::{Path, PathBuf};
use tokio::io::AsyncWriteExt;
use tsumu::InputKinds;

/// Uploads lie here, below the opened folder.
pub const PLACE: &str = "files";
/// Largest upload; a larger survey is put into the folder by hand, where it is listed.
const LARGEST: u64 = 64 << 30;
/// What must stay free for the system and for results.
const RESERVE: u64 = 512 << 20;
/// The free space is looked at again after so many bytes.
const LOOK_AGAIN: u64 = 64 << 20;

/// Free space where the folder lies, bytes.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    fs4::available_space(folder).ok()
}

/// Where an upload of so many bytes will lie. Errors: there is no room, the name is taken or of no kind that can be used.
pub fn place(root: &Path, name: &str, bytes: u64) -> Answer<PathBuf> {
    let name = made_plain(name)?;
    if !InputKinds::of(Path::new(&name)).any() {
        return Err(Refusal::bad("kind-of-file", name));
    }
    room(root, bytes)?;
    let place = root.join(PLACE).join(&name);
    if place.exists() { Err(Refusal::conflict("file-there", name)) } else { Ok(place) }
}

/// Stores the body and returns the file's path. Errors: those of [`place`], its length is not stated, the body ends early. Nothing
/// stays of a refused upload.
pub async fn store(root: &Path, name: &str, headers: &HeaderMap, body: Body) -> Answer<PathBuf> {
    let length = headers.get(header::CONTENT_LENGTH).and_then(|h| h.to_str().ok()?.parse().ok());
    let length: u64 = length.ok_or_else(|| {
        Refusal::new(StatusCode::LENGTH_REQUIRED, "length", "the size of the file is not stated")
    })?;
    let place = place(root, name, length)?;
    let folder = root.join(PLACE);
    tokio::fs::create_dir_all(&folder).await.map_err(|e| Refusal::system("make a folder", &e))?;
    let part = tempfile::Builder::new()
        .prefix(".tsumu-upload-")
        .tempfile_in(&folder)
        .map_err(|e| Refusal::system("write the upload", &e))?;
    fill(part.as_file(), root, length, body).await?;
    part.persist_noclobber(&place)
        .map_err(|_| Refusal::conflict("file-there", name.to_string()))?;
    Ok(place)
}

fn room(root: &Path, bytes: u64) -> Answer<()> {
    let no = |message| Err(Refusal::new(StatusCode::INSUFFICIENT_STORAGE, "no-room", message));
    if bytes > LARGEST {
        return no(format!("{bytes} bytes are more than the {LARGEST} that are taken"));
    }
    match free_bytes(root) {
        Some(free) if free < bytes.saturating_add(RESERVE) => {
            no(format!("the file has {bytes} bytes, {free} are free"))
        }
        _ => Ok(()),
    }
}

async fn fill(part: &std::fs::File, root: &Path, length: u64, body: Body) -> Answer<()> {
    let failed = |e: &std::io::Error| Refusal::system("write the upload", e);
    let mut file = tokio::fs::File::from_std(part.try_clone().map_err(|e| failed(&e))?);
    let mut pieces = body.into_data_stream();
    let (mut written, mut looked) = (0_u64, 0_u64);
    while let Some(piece) = pieces.next().await {
        let piece = piece.map_err(|e| Refusal::bad("broken-off", e.to_string()))?;
        written += piece.len() as u64;
        if written > length {
            return Err(Refusal::bad("broken-off", "the file is longer than stated"));
        }
        if written - looked > LOOK_AGAIN {
            looked = written;
            room(root, length - written)?;
        }
        file.write_all(&piece).await.map_err(|e| failed(&e))?;
    }
    if written != length {
        return Err(Refusal::bad("broken-off", format!("{written} of {length} bytes came")));
    }
    file.flush().await.map_err(|e| failed(&e))?;
    file.sync_all().await.map_err(|e| failed(&e))
}
