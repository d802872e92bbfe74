//! Weights as safetensors bytes: what a file, a page or another framework can read without us.

use crate::half_weights::widened;
use burn::module::Module;
use burn::store::{ModuleStore, SafetensorsStore};
use std::collections::BTreeMap;

/// Why weights could not be read or written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// Not a safetensors file, or cut short.
    #[error("not a weights file: {0}; expected safetensors as `tsumu-lab train` writes it")]
    Format(String),
    /// The tensors are not those of this network.
    #[error("the weights do not fit this network: {0}")]
    Mismatch(String),
    /// A number that sixteen bits cannot hold.
    #[error("`{tensor}` holds {value}, which 16 bits cannot; leave these weights at 32")]
    Range {
        /// Name of the tensor.
        tensor: String,
        /// The number.
        value: f32,
    },
}

/// The module's tensors and `metadata` (text pairs of the safetensors header).
pub fn to_bytes<M: Module>(
    module: &M,
    metadata: &BTreeMap<String, String>,
) -> Result<Vec<u8>, WeightsError> {
    let mut store = SafetensorsStore::from_bytes(None);
    for (key, value) in metadata {
        store = store.metadata(key, value);
    }
    store.collect_from(module).map_err(|e| WeightsError::Format(e.to_string()))?;
    let bytes = store.get_bytes().map_err(|e| WeightsError::Format(e.to_string()))?;
    sorted_header(&bytes)
}

/// The same file with the keys of its header in order: the library writes them as a hash map has them, so that equal
/// weights would give different bytes.
fn sorted_header(bytes: &[u8]) -> Result<Vec<u8>, WeightsError> {
    let length =
        u64::from_le_bytes(bytes[..8].try_into().expect("the library wrote a header")) as usize;
    Ok(file(&header(bytes)?, &bytes[8 + length..]))
}

/// A file of this header and these tensors.
pub(crate) fn file(header: &serde_json::Value, data: &[u8]) -> Vec<u8> {
    // A JSON object of this library is ordered by key.
    let mut text = header.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(8), b' ');
    let mut out = (text.len() as u64).to_le_bytes().to_vec();
    out.extend(text);
    out.extend(data);
    out
}

/// The text pairs of the header.
pub fn metadata(bytes: &[u8]) -> Result<BTreeMap<String, String>, WeightsError> {
    let header = header(bytes)?;
    let pairs = header.get("__metadata__").and_then(|m| m.as_object());
    Ok(pairs
        .into_iter()
        .flatten()
        .filter_map(|(k, v)| v.as_str().map(|v| (k.clone(), v.to_owned())))
        .collect())
}

/// Fills the module from the bytes, of 32 or of 16 bits a number; every tensor must be there with its shape, and no other.
pub fn from_bytes<M: Module>(module: &mut M, bytes: &[u8]) -> Result<(), WeightsError> {
    let mut store = SafetensorsStore::from_bytes(Some(widened(bytes)?.into_owned()));
    let result = store.apply_to(module).map_err(|e| WeightsError::Mismatch(e.to_string()))?;
    if let Some(error) = result.errors.first() {
        return Err(WeightsError::Mismatch(error.to_string()));
    }
    if let Some((missing, _)) = result.missing.first() {
        return Err(WeightsError::Mismatch(format!("`{missing}` is missing")));
    }
    if let Some(unused) = result.unused.first() {
        return Err(WeightsError::Mismatch(format!("`{unused}` is not part of it")));
    }
    Ok(())
}

fn header(bytes: &[u8]) -> Result<serde_json::Value, WeightsError> {
    parts(bytes).map(|(header, _)| header)
}

/// Header and tensors of a file.
pub(crate) fn parts(bytes: &[u8]) -> Result<(serde_json::Value, &[u8]), WeightsError> {
    let short = || WeightsError::Format("the header is cut short".into());
    let length =
        u64::from_le_bytes(bytes.get(..8).ok_or_else(short)?.try_into().expect("eight bytes"));
    let end = usize::try_from(length).ok().and_then(|l| l.checked_add(8)).ok_or_else(short)?;
    let text = bytes.get(8..end).ok_or_else(short)?;
    let header = serde_json::from_slice(text).map_err(|e| WeightsError::Format(e.to_string()))?;
    Ok((header, &bytes[end..]))
}
