//! A signature over a run's manifest: who vouches for it, and that nobody changed it since.
//!
//! The manifest holds the hash of every file, so that one signature over it covers the run. Keys and signatures are
//! those of minisign (Ed25519), which anybody can check without this program: `minisign -Vm manifest.json -P KEY`.

use crate::input::read_bytes;
use crate::{IoError, atomic, manifest};
use minisign::{KeyPair, PublicKey, PublicKeyBox, SecretKeyBox, SignatureBox};
use std::io::Cursor;
use std::path::Path;

/// Name in the run folder, beside the manifest.
pub const FILE: &str = "manifest.json.minisig";

/// Keys and signatures are some hundred bytes.
const LARGEST: u64 = 16 << 10;
/// Manifests are text about some hundred files.
const LARGEST_MANIFEST: u64 = 64 << 20;

/// Makes a pair of keys: the secret one at `file`, readable by its owner alone, the public one beside it with `.pub` at the end of its name.
/// Neither may exist. The secret key has no password: who can read the file can sign.
pub fn new_keys(file: &Path) -> Result<std::path::PathBuf, IoError> {
    let mut public_name = file.as_os_str().to_owned();
    public_name.push(".pub");
    let public = std::path::PathBuf::from(public_name);
    for path in [file, &public] {
        if path.symlink_metadata().is_ok() {
            let what =
                "there is such a file already; a key is never overwritten, choose another name";
            return Err(IoError::unsupported(path, what));
        }
    }
    let wrong = |e: minisign::PError| IoError::unsupported(file, format!("no key was made: {e}"));
    let pair = KeyPair::generate_unencrypted_keypair().map_err(wrong)?;
    let secret = pair.sk.to_box(Some("tsumu secret key")).map_err(wrong)?.into_string();
    let open = pair.pk.to_box().map_err(wrong)?.into_string();
    write_private(file, secret.as_bytes())?;
    atomic::write_bytes(&public, open.as_bytes())?;
    Ok(public)
}

/// Signs the manifest of a finished run with a secret key file; leaves [`FILE`] in its folder.
pub fn sign(run: &Path, key: &Path) -> Result<(), IoError> {
    manifest::Manifest::load(run)?;
    let content = read_bytes(&run.join(manifest::FILE), LARGEST_MANIFEST)?;
    let wrong = |e: minisign::PError| {
        IoError::unsupported(key, format!("not a secret key without a password: {e}"))
    };
    let secret = SecretKeyBox::from_string(&text(key)?)
        .and_then(SecretKeyBox::into_unencrypted_secret_key)
        .map_err(wrong)?;
    let public = PublicKey::from_secret_key(&secret).map_err(wrong)?;
    // The comment is signed too; it names the file and, for the same run to be signed alike, no time.
    let comment = format!("file:{}", manifest::FILE);
    let signature = minisign::sign(
        Some(&public),
        &secret,
        Cursor::new(content),
        Some(&comment),
        Some("signature of a tsumu run"),
    )
    .map_err(wrong)?;
    atomic::write_bytes(&run.join(FILE), signature.into_string().as_bytes())
}

/// Checks the signature of a run's manifest against a public key: a key file, or the key itself in base64. What the
/// manifest says of the files is [`manifest::verify`]'s to check.
pub fn check(run: &Path, key: &str) -> Result<(), IoError> {
    let path = run.join(FILE);
    let file = Path::new(key);
    let public = if file.exists() {
        PublicKeyBox::from_string(&text(file)?).and_then(PublicKeyBox::into_public_key)
    } else {
        PublicKey::from_base64(key)
    }
    .map_err(|e| {
        IoError::unsupported(file, format!("neither a public key nor a file of one: {e}"))
    })?;
    if !path.exists() {
        let what = "the run is not signed; `tsumu sign` signs it";
        return Err(IoError::unsupported(&path, what));
    }
    let signature = SignatureBox::from_string(&text(&path)?)
        .map_err(|e| IoError::unsupported(&path, format!("not a signature: {e}")))?;
    let content = read_bytes(&run.join(manifest::FILE), LARGEST_MANIFEST)?;
    minisign::verify(&public, &signature, Cursor::new(content), true, false, false).map_err(|e| {
        let what = format!(
            "the signature is not that of this manifest by this key ({e}); the run was changed after it was signed, or somebody else signed it"
        );
        IoError::unsupported(&path, what)
    })
}

fn text(path: &Path) -> Result<String, IoError> {
    String::from_utf8(read_bytes(path, LARGEST)?)
        .map_err(|_| IoError::unsupported(path, "it is not text, so it is no key and no signature"))
}

/// A file only its owner can read from the moment it exists.
fn write_private(path: &Path, content: &[u8]) -> Result<(), IoError> {
    use std::io::Write;
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options
        .open(path)
        .and_then(|mut file| file.write_all(content).and_then(|()| file.sync_all()))
        .map_err(|e| IoError::write(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_signed_run_is_known_and_a_changed_one_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let (run, key) = (folder.path().join("run"), folder.path().join("office.key"));
        let mut made = manifest::Manifest::new("0.2.0", 7, serde_json::Value::Null);
        made.seal(&run, []).unwrap();
        let public = new_keys(&key).unwrap();
        let public = public.to_str().unwrap();
        assert!(new_keys(&key).unwrap_err().to_string().contains("never overwritten"));
        assert!(check(&run, public).unwrap_err().to_string().contains("not signed"));
        sign(&run, &key).unwrap();
        check(&run, public).unwrap();
        let in_base64 = fs::read_to_string(public).unwrap().lines().nth(1).unwrap().to_string();
        check(&run, &in_base64).unwrap();
        assert_eq!(manifest::verify(&run, None).unwrap(), [], "a signature is no foreign file");

        let other = new_keys(&folder.path().join("other.key")).unwrap();
        assert!(check(&run, other.to_str().unwrap()).is_err());
        made.seed = 8;
        made.seal(&run, []).unwrap();
        let message = check(&run, public).unwrap_err().to_string();
        assert!(message.contains("changed after it was signed"), "{message}");
        assert!(check(&run, "nonsense").unwrap_err().to_string().contains("nonsense"));
        assert!(sign(&run, Path::new(public)).unwrap_err().to_string().contains("secret key"));
    }
}
